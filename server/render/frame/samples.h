/* SPDX-License-Identifier: MIT */
/* The samples of a picture: sample by sample, strip by strip where first hits are rasterised, slice by slice. */
#ifndef FARLIGHT_RENDER_FRAME_SAMPLES_H
#define FARLIGHT_RENDER_FRAME_SAMPLES_H

#include "render/context/pass.h"
#include "render/frame/state.h"

/* Adds the request's samples to the picture. PASS_REPEAT: another picture of the frame follows (frame/key.h). */
extern const struct pass samples_pass;
/* Adds the slice's sums, and its notes, to the picture. */
extern const struct pass sums_pass;

/* Reserves buffers for slices of slice_rays_max rays and waves of wave.capacity rays. */
bool samples_reserve(struct frame_renderer *renderer, struct error *error);
/* Whether the next step would only wait for slices that are queued on the device. */
bool samples_wait(const struct frame_renderer *renderer);

#endif
