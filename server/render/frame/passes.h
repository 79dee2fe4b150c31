/* SPDX-License-Identifier: MIT */
/* The list of passes of a frame, in order, and of each slice of its samples. */
#ifndef FARLIGHT_RENDER_FRAME_PASSES_H
#define FARLIGHT_RENDER_FRAME_PASSES_H

#include "render/frame/state.h"

/* Runs a step of the frame's pass renderer->phase. */
enum pass_progress passes_run(struct frame_renderer *renderer, struct error *error);
/* The first phase from that one on with a pass that the frame wants; PHASE_COUNT: there is none. */
enum frame_phase passes_next(const struct frame_renderer *renderer, enum frame_phase phase);

/* Begins the passes over a slice, which the wave has, and runs the first step of the first one. */
enum pass_progress passes_begin_slice(struct frame_renderer *renderer, struct error *error);
/* Runs a step of the slice's pass in progress. PASS_DONE: the slice's samples are in the picture. */
enum pass_progress passes_run_slice(struct frame_renderer *renderer, struct error *error);
/* Reserves the buffers of all passes over slices. */
bool passes_reserve(struct frame_work *work, uint32_t slice_samples, struct error *error);
/* Releases the memory of all passes. */
void passes_finish(struct frame_work *work, struct gpu_device *device);

#endif
