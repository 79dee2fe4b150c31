/* SPDX-License-Identifier: MIT */
/* The functions of gpu/ and render/ that the engine calls, as a table: the real ones, or those of a test. */
#ifndef FARLIGHT_ENGINE_BACKEND_H
#define FARLIGHT_ENGINE_BACKEND_H

#include "gpu/device.h"
#include "render/frame/frame.h"

/* Every function is called on the engine's thread, and does what the function of the same name in gpu/ or render/
 * does. */
struct engine_backend {
    struct gpu_device *(*device_create)(const struct gpu_options *options, struct error *error);
    void (*device_destroy)(struct gpu_device *device);
    struct frame_scene *(*scene_create)(struct gpu_device *device, struct error *error);
    void (*scene_destroy)(struct frame_scene *shared);
    uint64_t (*scene_bytes)(const struct frame_scene *shared);
    struct frame_renderer *(*renderer_create)(struct frame_scene *shared, struct error *error);
    void (*renderer_destroy)(struct frame_renderer *renderer);
    uint64_t (*renderer_bytes)(const struct frame_renderer *renderer);
    bool (*may_begin)(const struct frame_renderer *renderer, const struct scene *scene,
                      const struct scene_motion *motion, const struct frame_request *request);
    bool (*begin)(struct frame_renderer *renderer, const struct scene *scene, const struct scene_motion *motion,
                  const struct frame_request *request, struct error *error);
    enum frame_progress (*step)(struct frame_renderer *renderer, struct frame_result *result, struct error *error);
    bool (*step_waits)(const struct frame_renderer *renderer);
    void (*abandon)(struct frame_renderer *renderer);
};
extern const struct engine_backend engine_backend_gpu;

#endif
