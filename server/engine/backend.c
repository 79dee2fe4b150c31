/* SPDX-License-Identifier: MIT */
#include "engine/backend.h"

#include "check/first_hits.h"

static struct gpu_device *device_create(const struct gpu_options *options, struct error *error)
{
    struct gpu_device *device = gpu_device_create(options, error);
    if (device)
        first_hits_decide(device);
    return device;
}

const struct engine_backend engine_backend_gpu = {
    .device_create = device_create,
    .device_destroy = gpu_device_destroy,
    .scene_create = frame_scene_create,
    .scene_destroy = frame_scene_destroy,
    .scene_bytes = frame_scene_device_bytes,
    .renderer_create = frame_renderer_create,
    .renderer_destroy = frame_renderer_destroy,
    .renderer_bytes = frame_renderer_device_bytes,
    .may_begin = frame_may_begin,
    .begin = frame_begin,
    .step = frame_step,
    .step_waits = frame_step_waits,
    .abandon = frame_abandon,
};
