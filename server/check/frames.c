/* SPDX-License-Identifier: MIT */
/* Renders frames of a generated scene. */
#include "check/frames.h"

#include "render/context/camera.h"

bool check_frames_init(struct check_frames *frames, struct gpu_device *device, struct scene *scene,
                       struct error *error)
{
    *frames = (struct check_frames){.device = device, .scene = scene};
    if (scene)
        frames->shared = frame_scene_create(device, error);
    if (frames->shared)
        frames->renderer = frame_renderer_create(frames->shared, error);
    if (frames->renderer)
        return true;
    check_frames_finish(frames);
    return false;
}

void check_frames_finish(struct check_frames *frames)
{
    frame_renderer_destroy(frames->renderer);
    frame_scene_destroy(frames->shared);
    scene_destroy(frames->scene);
    *frames = (struct check_frames){0};
}

bool check_frame(struct check_frames *frames, const struct frame_request *request, struct frame_result *result,
                 struct error *error)
{
    enum frame_progress progress = FRAME_MORE;
    *result = (struct frame_result){0};
    if (!frame_begin(frames->renderer, frames->scene, NULL, request, error))
        return false;
    while (progress == FRAME_MORE)
        progress = frame_step(frames->renderer, result, error);
    return progress == FRAME_DONE;
}

struct frame_request check_request(unsigned tracer, uint32_t width, uint32_t height)
{
    struct frame_request request = {
        .picture.width = width,
        .picture.height = height,
        .sampling.samples = 1,
        .light.depth = 3,
        .tracing.tracer = tracer,
        .tracer_options = {.ldc.resolution = CHECK_CELLS, .abuffer.resolution = CHECK_CELLS},
        .light.integrator = INTEGRATOR_WHITTED,
        .picture.format = PIXEL_FORMAT_RGBA32F,
    };
    (void)frame_camera_look_at(&request.camera, (const float[]){0.7f, 2.2f, 5}, (const float[]){0, 0, 0},
                               (const float[]){0, 1, 0}, 0.8f);
    return request;
}
