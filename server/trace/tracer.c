/* SPDX-License-Identifier: MIT */
#include "trace/tracer.h"

#include "shared/hit.h"
#include "shared/ray.h"

/* By the protocol's numbers; a tracer that a build leaves out is NULL. */
static const struct tracer_impl *const tracers[] = {
    [0] = &tracer_bvh_impl,
    [1] = &tracer_naive_impl,
};

const struct tracer_impl *tracer_impl_by_number(unsigned number)
{
    return number < sizeof(tracers) / sizeof(tracers[0]) ? tracers[number] : NULL;
}

struct tracer *tracer_create(const struct tracer_impl *impl, struct gpu_device *device,
                             const struct tracer_options *options, struct error *error)
{
    static const struct tracer_options defaults;
    struct tracer *tracer = impl->create(device, options ? options : &defaults, error);
    if (!tracer)
        return NULL;
    tracer->impl = impl;
    tracer->device = device;
    tracer->options = options ? *options : defaults;
    return tracer;
}

void tracer_destroy(struct tracer *tracer)
{
    if (tracer)
        tracer->impl->destroy(tracer);
}

bool tracer_update(struct tracer *tracer, struct scene_gpu *scene, const struct scene_changes *changes,
                   struct stage_times *times, struct error *error)
{
    static const struct scene_changes everything = {
        .geometry = true, .instances = true, .shading = true, .lights = true};
    gpu_push_group(tracer->device, tracer->impl->name);
    bool ok = tracer->impl->update(tracer, scene, tracer->updated ? changes : &everything, times, error) &&
              gpu_check(tracer->device, tracer->impl->name, error);
    gpu_pop_group(tracer->device);
    /* After a failure nothing is known of the structure: the next update makes it anew. */
    tracer->updated = ok;
    return ok;
}

static bool buffer_holds(const struct gpu_buffer *buffer, uint32_t count, size_t item_bytes)
{
    return buffer && buffer->size_bytes / item_bytes >= count;
}

bool tracer_trace(struct tracer *tracer, struct scene_gpu *scene, const struct wave *wave, struct error *error)
{
    bool fits = wave->ray_count > 0 && buffer_holds(wave->rays, wave->ray_count, sizeof(struct ray));
    if (wave->kind == WAVE_ANY)
        fits = fits && buffer_holds(wave->visibility, wave->ray_count, sizeof(uint32_t));
    else
        fits = fits && buffer_holds(wave->hits, wave->ray_count, sizeof(struct hit));
    if (!fits)
        return error_set(error, ERROR_INTERNAL, NULL, "%s: a wave of %u rays does not fit its buffers",
                         tracer->impl->name, wave->ray_count);
    if (!tracer->updated)
        return error_set(error, ERROR_INTERNAL, NULL, "%s: traced before it was brought to the scene",
                         tracer->impl->name);
    gpu_push_group(tracer->device, tracer->impl->name);
    bool ok =
        tracer->impl->trace(tracer, scene, wave, error) && gpu_check(tracer->device, tracer->impl->name, error);
    gpu_pop_group(tracer->device);
    return ok;
}
