/* SPDX-License-Identifier: MIT */
#include "render/tracer_set.h"

void tracer_set_note(struct tracer_set *set, const struct scene_changes *changes)
{
    for (int i = 0; i < TRACERS_KEPT; i++) {
        struct scene_changes *pending = &set->slots[i].pending;
        if (!changes) {
            if (set->slots[i].tracer)
                tracer_outdate(set->slots[i].tracer);
            continue;
        }
        pending->geometry |= changes->geometry;
        pending->deformed |= changes->deformed;
        pending->instances |= changes->instances;
        pending->shading |= changes->shading;
        pending->surfaces |= changes->surfaces;
        pending->lights |= changes->lights;
    }
}

static void empty_slot(struct tracer_slot *slot)
{
    tracer_destroy(slot->tracer);
    *slot = (struct tracer_slot){0};
}

static struct tracer_slot *find_slot(struct tracer_set *set, const struct tracer_impl *impl,
                                     const struct tracer_options *options)
{
    for (int i = 0; i < TRACERS_KEPT; i++)
        if (set->slots[i].tracer && set->slots[i].impl == impl &&
            tracer_options_same(&set->slots[i].options, options))
            return &set->slots[i];
    return NULL;
}

static struct tracer_slot *make_slot(struct tracer_set *set, struct gpu_device *device,
                                     const struct tracer_impl *impl, const struct tracer_options *options,
                                     struct error *error)
{
    struct tracer_slot *oldest = &set->slots[0];
    for (int i = 1; i < TRACERS_KEPT; i++)
        if (set->slots[i].last_use < oldest->last_use)
            oldest = &set->slots[i];
    empty_slot(oldest);
    oldest->tracer = tracer_create(impl, device, options, error);
    if (!oldest->tracer)
        return NULL;
    oldest->impl = impl;
    oldest->options = *options;
    return oldest;
}

struct tracer *tracer_set_get(struct tracer_set *set, struct scene_gpu *scene, const struct tracer_impl *impl,
                              const struct tracer_options *options, struct stage_times *times, struct error *error)
{
    struct tracer_slot *slot = find_slot(set, impl, options);
    if (!slot)
        slot = make_slot(set, scene->device, impl, options, error);
    if (!slot)
        return NULL;
    slot->last_use = ++set->use_count;
    if (!tracer_update(slot->tracer, scene, &slot->pending, times, error))
        return NULL;
    slot->pending = (struct scene_changes){0};
    return slot->tracer;
}

uint64_t tracer_set_device_bytes(const struct tracer_set *set)
{
    uint64_t sum = 0;
    for (int i = 0; i < TRACERS_KEPT; i++)
        if (set->slots[i].tracer)
            sum += set->slots[i].tracer->stats.device_bytes;
    return sum;
}

void tracer_set_finish(struct tracer_set *set)
{
    for (int i = 0; i < TRACERS_KEPT; i++)
        empty_slot(&set->slots[i]);
}
