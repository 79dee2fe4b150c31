/* SPDX-License-Identifier: MIT */
#include "job/backend.h"

const struct engine_backend engine_backend_gpu = {
    .device_create = gpu_device_create,
    .device_destroy = gpu_device_destroy,
    .renderer_create = frame_renderer_create,
    .renderer_destroy = frame_renderer_destroy,
    .begin = frame_begin,
    .step = frame_step,
    .abandon = frame_abandon,
    .device_bytes = frame_renderer_device_bytes,
};
