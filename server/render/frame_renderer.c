/* SPDX-License-Identifier: MIT */
/* A renderer's life, and what it holds on the device. */
#include "render/frame_state.h"

#include <stdlib.h>

void frame_result_finish(struct frame_result *result)
{
    free(result->pixels);
    free(result->comparisons);
    *result = (struct frame_result){0};
}

struct frame_renderer *frame_renderer_create(struct gpu_device *device, struct error *error)
{
    struct frame_renderer *renderer = calloc(1, sizeof(*renderer));
    if (!renderer) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a renderer");
        return NULL;
    }
    renderer->device = device;
    scene_gpu_init(&renderer->scene, device);
    renderer->context.device = device;
    renderer->context.scene = &renderer->scene;
    renderer->context.timer = gpu_timer_create(device);
    if (!renderer->context.timer) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the frame's timer");
        frame_renderer_destroy(renderer);
        return NULL;
    }
    return renderer;
}

void frame_drop_integrator(struct frame_renderer *renderer)
{
    if (renderer->integrator)
        renderer->integrator->impl->destroy(renderer->integrator);
    renderer->integrator = NULL;
}

void frame_renderer_destroy(struct frame_renderer *renderer)
{
    if (!renderer)
        return;
    frame_drop_integrator(renderer);
    comparison_destroy(renderer->comparison);
    tracer_set_finish(&renderer->tracers);
    primary_finish(&renderer->primary, renderer->device);
    picture_finish(&renderer->picture, renderer->device);
    layers_finish(&renderer->layers, renderer->device);
    context_finish(&renderer->context);
    gpu_timer_destroy(renderer->context.timer);
    scene_gpu_finish(&renderer->scene);
    free(renderer);
}

void frame_renderer_set_capacity(struct frame_renderer *renderer, uint32_t slice_pixels, uint32_t wave_rays)
{
    renderer->wanted_slice_pixels = slice_pixels;
    renderer->wanted_wave_rays = wave_rays;
}

void frame_renderer_stand_in(struct frame_renderer *renderer, unsigned number, const struct tracer_impl *impl)
{
    renderer->stand_in = impl;
    renderer->stand_in_number = number;
}

uint64_t frame_renderer_device_bytes(const struct frame_renderer *renderer)
{
    uint64_t sum = scene_gpu_device_bytes(&renderer->scene) + tracer_set_device_bytes(&renderer->tracers) +
                   context_device_bytes(&renderer->context) + renderer->primary.visible.size_bytes +
                   renderer->primary.depth.size_bytes + picture_device_bytes(&renderer->picture) +
                   layers_device_bytes(&renderer->layers);
    if (renderer->integrator)
        sum += renderer->integrator->impl->device_bytes(renderer->integrator);
    if (renderer->comparison)
        sum += comparison_device_bytes(renderer->comparison);
    return sum;
}
