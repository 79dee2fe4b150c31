/* SPDX-License-Identifier: MIT */
/* Sets of tracers that are kept: the changes that each still has to receive, and the choice of the one to
 * replace. */
#include "render/frame/tracer_set.h"

#include <string.h>

void change_history_note(struct change_history *history, unsigned changed)
{
    if (!changed)
        return;
    history->update_count++;
    for (unsigned left = changed; left; left &= left - 1)
        history->last[__builtin_ctz(left)] = history->update_count;
}

/* Bits that changed after that many updates. */
static unsigned change_history_since(const struct change_history *history, uint64_t update_count)
{
    unsigned changed = 0;
    for (unsigned bit = 0; bit < sizeof(changed) * 8; bit++)
        changed |= history->last[bit] > update_count ? 1u << bit : 0;
    return changed;
}

static void empty_slot(struct tracer_slot *slot)
{
    tracer_destroy(slot->tracer);
    *slot = (struct tracer_slot){0};
}

static bool holds(const struct tracer_slot *slot, const struct tracer_impl *impl,
                  const struct tracer_options *options)
{
    return slot->tracer && slot->impl == impl && tracer_options_same(&slot->options, options);
}

static bool is_up_to_date(const struct tracer_set *set, const struct tracer_slot *slot)
{
    return slot->tracer->updated && !slot->tracer->updating &&
           !(change_history_since(set->history, slot->told) & slot->impl->depends_on);
}

bool tracer_set_are_free(const struct tracer_set *set, const struct tracer_impl *const impls[], size_t count,
                         const struct tracer_options *options)
{
    size_t missing = count, room = 0;
    for (int i = 0; i < TRACERS_KEPT; i++) {
        const struct tracer_slot *slot = &set->slots[i];
        bool wanted = false;
        for (size_t k = 0; k < count; k++)
            wanted = wanted || holds(slot, impls[k], options);
        if (wanted && slot->users && !is_up_to_date(set, slot) && !slot->tracer->updating)
            return false;
        missing -= wanted;
        room += !wanted && !slot->users;
    }
    return missing <= room;
}

static struct tracer_slot *find_slot(struct tracer_set *set, const struct tracer_impl *impl,
                                     const struct tracer_options *options)
{
    for (int i = 0; i < TRACERS_KEPT; i++)
        if (holds(&set->slots[i], impl, options))
            return &set->slots[i];
    return NULL;
}

static struct tracer_slot *make_slot(struct tracer_set *set, struct gpu_device *device,
                                     const struct tracer_impl *impl, const struct tracer_options *options,
                                     struct error *error)
{
    struct tracer_slot *oldest = NULL;
    for (int i = 0; i < TRACERS_KEPT; i++)
        if (!set->slots[i].users && (!oldest || set->slots[i].last_use < oldest->last_use))
            oldest = &set->slots[i];
    empty_slot(oldest);
    oldest->tracer = tracer_create(impl, device, options, error);
    if (!oldest->tracer)
        return NULL;
    oldest->impl = impl;
    oldest->options = *options;
    return oldest;
}

struct tracer *tracer_set_take(struct tracer_set *set, struct gpu_device *device, const struct tracer_impl *impl,
                               const struct tracer_options *options, struct error *error)
{
    if (!tracer_set_are_free(set, &impl, 1, options)) {
        error_set(error, ERROR_INTERNAL, NULL, "%s cannot be brought to the scene beside other frames",
                  impl->name);
        return NULL;
    }
    struct tracer_slot *slot = find_slot(set, impl, options);
    if (!slot)
        slot = make_slot(set, device, impl, options, error);
    if (!slot)
        return NULL;
    slot->last_use = ++set->use_count;
    slot->users++;
    return slot->tracer;
}

static struct tracer_slot *slot_of(struct tracer_set *set, const struct tracer *tracer)
{
    for (int i = 0; tracer && i < TRACERS_KEPT; i++)
        if (set->slots[i].tracer == tracer)
            return &set->slots[i];
    return NULL;
}

struct tracer *tracer_set_take_again(struct tracer_set *set, struct tracer *tracer)
{
    slot_of(set, tracer)->users++;
    return tracer;
}

static unsigned pending(const struct tracer_set *set, const struct tracer_slot *slot,
                        const struct trace_view *view)
{
    unsigned changed = change_history_since(set->history, slot->told);
    if (view && memcmp(view, &slot->view, sizeof(*view)) != 0)
        changed |= CHANGED_VIEW;
    return changed;
}

enum tracer_progress tracer_set_bring(struct tracer_set *set, const struct tracer *tracer, struct gpu_scene *scene,
                                      const struct tracer_update *update, uint64_t step_ns, struct error *error)
{
    struct tracer_slot *slot = slot_of(set, tracer);
    struct tracer_update own = *update;
    own.changed = pending(set, slot, update->view);
    enum tracer_progress progress = tracer_update_step(slot->tracer, scene, &own, step_ns, error);
    if (progress != TRACER_DONE)
        return progress;
    slot->told = set->history->update_count;
    if (update->view)
        slot->view = *update->view;
    return TRACER_DONE;
}

void tracer_set_give(struct tracer_set *set, const struct tracer *tracer)
{
    struct tracer_slot *slot = slot_of(set, tracer);
    if (slot && --slot->users == 0)
        tracer_update_abandon(slot->tracer);
}

uint64_t tracer_set_device_bytes(const struct tracer_set *set)
{
    uint64_t sum = 0;
    for (int i = 0; i < TRACERS_KEPT; i++)
        if (set->slots[i].tracer)
            sum += tracer_device_bytes(set->slots[i].tracer);
    return sum;
}

void tracer_set_finish(struct tracer_set *set)
{
    for (int i = 0; i < TRACERS_KEPT; i++)
        empty_slot(&set->slots[i]);
}
