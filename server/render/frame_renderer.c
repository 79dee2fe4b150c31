/* SPDX-License-Identifier: MIT */
/* What renderers share, a renderer's life, and what they hold on the device. */
#include "render/frame_state.h"

#include <stdlib.h>

void frame_result_finish(struct frame_result *result)
{
    free(result->pixels);
    free(result->comparisons);
    *result = (struct frame_result){0};
}

struct frame_scene *frame_scene_create(struct gpu_device *device, struct error *error)
{
    struct frame_scene *shared = calloc(1, sizeof(*shared));
    if (!shared) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a scene on the device");
        return NULL;
    }
    shared->device = device;
    scene_gpu_init(&shared->copy, device);
    return shared;
}

void frame_scene_destroy(struct frame_scene *shared)
{
    if (!shared)
        return;
    tracer_set_finish(&shared->tracers);
    environment_finish(&shared->environment, shared->device);
    scene_gpu_finish(&shared->copy);
    free(shared);
}

uint64_t frame_scene_device_bytes(const struct frame_scene *shared)
{
    return scene_gpu_device_bytes(&shared->copy) + tracer_set_device_bytes(&shared->tracers);
}

struct frame_renderer *frame_renderer_create(struct frame_scene *shared, struct error *error)
{
    struct frame_renderer *renderer = calloc(1, sizeof(*renderer));
    if (!renderer) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a renderer");
        return NULL;
    }
    renderer->device = shared->device;
    renderer->shared = shared;
    renderer->context.device = shared->device;
    renderer->context.scene = &shared->copy;
    renderer->context.environment = &shared->environment;
    renderer->context.timer = gpu_timer_create(shared->device);
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
    frame_end(renderer);
    frame_drop_integrator(renderer);
    comparison_destroy(renderer->comparison);
    primary_finish(&renderer->primary, renderer->device);
    picture_finish(&renderer->picture, renderer->device);
    layers_finish(&renderer->layers, renderer->device);
    context_finish(&renderer->context);
    gpu_timer_destroy(renderer->context.timer);
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
    uint64_t sum = context_device_bytes(&renderer->context) + renderer->primary.visible.size_bytes +
                   renderer->primary.depth.size_bytes + picture_device_bytes(&renderer->picture) +
                   layers_device_bytes(&renderer->layers);
    if (renderer->integrator)
        sum += renderer->integrator->impl->device_bytes(renderer->integrator);
    if (renderer->comparison)
        sum += comparison_device_bytes(renderer->comparison);
    return sum;
}
