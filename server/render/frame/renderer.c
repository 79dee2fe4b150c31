/* SPDX-License-Identifier: MIT */
/* The life of the shared state of a scene's renderers, and of a renderer; their memory on the device. */
#include "render/frame/renderer.h"

#include "host_passes/host_passes.h"
#include "render/frame/frame.h"
#include "render/frame/state.h"
#include "render/frame/work.h"
#include "render/light/environment.h"
#include "render/light/environment_choice.h"

#include <stdlib.h>

struct frame_scene *frame_scene_create(struct gpu_device *device, struct error *error)
{
    struct frame_scene *shared = calloc(1, sizeof(*shared));
    if (!shared) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a scene on the device");
        return NULL;
    }
    shared->device = device;
    shared->step_ns = STEP_NS;
    shared->tracers.history = &shared->changes;
    gpu_scene_init(&shared->copy, device);
    return shared;
}

void frame_scene_destroy(struct frame_scene *shared)
{
    if (!shared)
        return;
    frame_work_finish(shared);
    tracer_set_finish(&shared->tracers);
    environment_finish(&shared->environment, shared->device);
    environment_choice_finish(&shared->environment_choice, shared->device);
    gpu_scene_finish(&shared->copy);
    free(shared);
}

uint64_t frame_scene_device_bytes(const struct frame_scene *shared)
{
    uint64_t sum = gpu_scene_device_bytes(&shared->copy) + tracer_set_device_bytes(&shared->tracers) +
                   shared->environment_choice.table.capacity_bytes;
    for (const struct frame_work *work = shared->idle; work; work = work->next)
        sum += frame_work_device_bytes(work);
    return sum;
}

struct tracer_set *frame_tracers(struct frame_renderer *renderer, const struct tracer_impl *impl)
{
    return impl->depends_on & CHANGED_VIEW ? &renderer->tracers : &renderer->shared->tracers;
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
    renderer->tracers.history = &shared->changes;
    renderer->queues_ahead = !host_passes_of(shared->device); /* which need the counts */
    return renderer;
}

void frame_renderer_destroy(struct frame_renderer *renderer)
{
    if (!renderer)
        return;
    frame_abandon(renderer);
    tracer_set_finish(&renderer->tracers);
    picture_finish(&renderer->picture, renderer->device);
    denoise_sums_finish(&renderer->denoise, renderer->device);
    denoise_history_finish(&renderer->history, renderer->device);
    key_view_finish(&renderer->key, renderer->device);
    free(renderer);
}

uint64_t frame_renderer_device_bytes(const struct frame_renderer *renderer)
{
    return picture_device_bytes(&renderer->picture) + denoise_sums_device_bytes(&renderer->denoise) +
           denoise_history_device_bytes(&renderer->history) + key_view_device_bytes(&renderer->key) +
           tracer_set_device_bytes(&renderer->tracers) +
           (renderer->work ? frame_work_device_bytes(renderer->work) : 0);
}
