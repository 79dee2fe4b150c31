/* SPDX-License-Identifier: MIT */
/* Frames of a generated scene, rendered one after the other to completion. */
#ifndef FARLIGHT_CHECK_FRAMES_H
#define FARLIGHT_CHECK_FRAMES_H

#include "render/frame/frame.h"

/* A scene with its renderer; all-zero is empty. */
struct check_frames {
    struct gpu_device *device;
    struct scene *scene; /* owned */
    struct frame_scene *shared;
    struct frame_renderer *renderer;
};

/* Owns the scene from here on; NULL: it could not be made, and *error says so. False: `frames` is empty. */
bool check_frames_init(struct check_frames *frames, struct gpu_device *device, struct scene *scene,
                       struct error *error);
void check_frames_finish(struct check_frames *frames);
/* Renders a frame; the caller owns *result, see frame_result_finish(). */
bool check_frame(struct check_frames *frames, const struct frame_request *request, struct frame_result *result,
                 struct error *error);
/* Request for one sharp sample by `tracer`, whitted, from in front. Sampled tracers have `CHECK_CELLS` cells. */
#define CHECK_CELLS 512u
struct frame_request check_request(unsigned tracer, uint32_t width, uint32_t height);

#endif
