/* SPDX-License-Identifier: MIT */
/* Frames of a scene that is made here, one after the other, each to its end. */
#ifndef FARLIGHT_CHECK_FRAMES_H
#define FARLIGHT_CHECK_FRAMES_H

#include "render/frame/frame.h"

/* All-zero is the valid empty one. */
struct check_frames {
    struct gpu_device *device;
    struct scene *scene; /* owned */
    struct frame_scene *shared;
    struct frame_renderer *renderer;
};

/* Takes over the scene, NULL: it could not be made, which *error says. False: `frames` is empty. */
bool check_frames_init(struct check_frames *frames, struct gpu_device *device, struct scene *scene,
                       struct error *error);
void check_frames_finish(struct check_frames *frames);
/* *result is the caller's, frame_result_finish(). */
bool check_frame(struct check_frames *frames, const struct frame_request *request, struct frame_result *result,
                 struct error *error);
/* One sharp sample by `tracer`, whitted, from in front. Sampled tracers have `CHECK_CELLS` cells. */
#define CHECK_CELLS 512u
struct frame_request check_request(unsigned tracer, uint32_t width, uint32_t height);

#endif
