/* SPDX-License-Identifier: MIT */
/* Wrappers of tracer_impl: options, creation and updates. */
#include "trace/tracer.h"

#include <stdio.h>
#include <string.h>

/* A tracer that a build leaves out is NULL. */
static const struct tracer_impl *const tracers[TRACER_COUNT] = {
#define TRACER(NAME, name, number, use, needs, doc) [number] = &tracer_##name##_impl,
#include "protocol/tracers.def"
};

/* The options begin with the members of struct tracer_settings. */
_Static_assert(offsetof(struct tracer_options, limits) == sizeof(struct tracer_settings), "words alone");

struct tracer_options tracer_options_of(const struct tracer_settings *settings, const struct tracer_limits *limits)
{
    struct tracer_options options = {.limits = *limits};
    struct tracer_settings resolved = *settings;
    tracer_settings_resolve(&resolved);
    memcpy(&options, &resolved, sizeof(resolved));
    return options;
}

void tracer_options_note_picture(struct tracer_options *options, unsigned tracer, uint64_t pixels)
{
    uint32_t noted = 1;
    if (!(tracer == TRACER_LDC && options->ldc.resolution == 0) &&
        !(tracer == TRACER_ABUFFER && options->abuffer.resolution == 0))
        return;
    while ((double)noted * 1.4142135 < (double)pixels && noted < 1u << 31)
        noted *= 2;
    options->picture_pixels = noted;
}

bool tracer_options_same(const struct tracer_options *a, const struct tracer_options *b)
{
    return memcmp(a, b, sizeof(*a)) == 0;
}

const struct tracer_impl *tracer_impl_by_number(unsigned number)
{
    return number < TRACER_COUNT ? tracers[number] : NULL;
}

const struct tracer_impl *tracer_find(unsigned number, const char *field, struct error *error)
{
    const struct tracer_impl *impl = tracer_impl_by_number(number);
    if (impl)
        return impl;
    char list[128] = "";
    size_t used = 0;
    for (size_t i = 0; i < TRACER_COUNT && used < sizeof(list); i++)
        if (tracers[i])
            used += (size_t)snprintf(list + used, sizeof(list) - used, "%s%s", used ? ", " : "", tracers[i]->name);
    const struct tracer_desc *desc = tracer_describe(number);
    if (desc && desc->needs[0]) {
        error_set(error, ERROR_UNSUPPORTED, field,
                  "this farlightd was built without %s, which the tracer %s needs", desc->needs, desc->name);
        error_remedy(error, "install it and build farlightd again, or choose another tracer: %s", list);
    } else {
        error_set(error, ERROR_UNSUPPORTED, field, "this build has no tracer number %u", number);
        error_remedy(error, "available: %s", list);
    }
    return NULL;
}

bool tracer_check_motion(const struct tracer_impl *impl, const struct gpu_scene *scene, struct error *error)
{
    if (!impl->still || !scene->has_motion)
        return true;
    error_set(error, ERROR_UNSUPPORTED, "shutter",
              "%s holds samples of the scene as the shutter opens, and something moves before it closes",
              impl->name);
    return error_remedy(error, "take a shutter of 0, or another tracer");
}

struct tracer *tracer_create(const struct tracer_impl *impl, struct gpu_device *device,
                             const struct tracer_options *options, struct error *error)
{
    struct tracer_options resolved = {0};
    struct setting_fault fault;
    if (options)
        resolved = *options;
    struct tracer_settings settings;
    memcpy(&settings, &resolved, sizeof(settings));
    if (!tracer_settings_check(&settings, "options.", &fault)) {
        error_set(error, ERROR_INVALID, fault.field, "%s", fault.text);
        error_remedy(error, "%s", fault.remedy);
        return NULL;
    }
    resolved = tracer_options_of(&settings, &resolved.limits);
    if (options) {
        resolved.quadtree_leaves = options->quadtree_leaves;
        resolved.picture_pixels = options->picture_pixels;
    }
    struct tracer *tracer = impl->create(device, &resolved, error);
    if (!tracer)
        return NULL;
    tracer->impl = impl;
    tracer->device = device;
    tracer->options = resolved;
    return tracer;
}

void tracer_destroy(struct tracer *tracer)
{
    if (!tracer)
        return;
    trace_state_destroy(tracer->state);
    tracer->impl->destroy(tracer);
}

uint64_t tracer_device_bytes(const struct tracer *tracer)
{
    return tracer->stats.device_bytes + (tracer->state ? trace_state_device_bytes(tracer->state) : 0);
}

void tracer_report(const struct tracer *tracer, struct structure_rows *rows)
{
    *rows = (struct structure_rows){0};
    if (tracer->impl->report)
        tracer->impl->report(tracer, rows);
}

/* Resets the stats of the last update. */
static void begin_stats(struct tracer_stats *stats)
{
    stats->uploaded_bytes = stats->nodes_rebuilt = stats->nodes_refitted = 0;
    stats->parts_built = 0;
}

enum tracer_progress tracer_update_step(struct tracer *tracer, struct gpu_scene *scene,
                                        const struct tracer_update *update, uint64_t step_ns, struct error *error)
{
    const struct tracer_impl *impl = tracer->impl;
    struct tracer_update own = *update;
    own.changed = impl->depends_on & (tracer->updated ? update->changed : CHANGED_ALL);
    if (!tracer->updating)
        begin_stats(&tracer->stats);
    if (tracer->updated && !tracer->updating && own.changed == 0)
        return TRACER_DONE;
    if ((impl->depends_on & CHANGED_VIEW) && !update->view) {
        error_set(error, ERROR_INTERNAL, NULL, "%s: an update without the view that it depends on", impl->name);
        return TRACER_FAILED;
    }
    gpu_push_group(tracer->device, impl->name);
    tracer->step_end_ns = step_ns == STEP_WITHOUT_END ? STEP_WITHOUT_END : clock_now_ns() + step_ns;
    enum tracer_progress progress = impl->update(tracer, scene, &own, error);
    bool good = progress != TRACER_FAILED && gpu_check_reset(tracer->device, impl->name, error);
    gpu_pop_group(tracer->device);
    if (!good && progress == TRACER_MORE)
        impl->abandon(tracer);
    tracer->updating = good && progress == TRACER_MORE;
    /* After a failure the structure is unknown: the next update rebuilds it. During an update that began with
     * the structure of some revision, the flag stays set for its steps. */
    tracer->updated = good && (progress == TRACER_DONE || tracer->updated);
    return good ? progress : TRACER_FAILED;
}

bool tracer_update_waits(struct tracer *tracer)
{
    return tracer->updating && tracer->impl->waits && tracer->impl->waits(tracer);
}

void tracer_update_abandon(struct tracer *tracer)
{
    if (!tracer->updating)
        return;
    gpu_push_group(tracer->device, tracer->impl->name);
    tracer->impl->abandon(tracer);
    gpu_pop_group(tracer->device);
    tracer->updating = tracer->updated = false;
}

bool tracer_update(struct tracer *tracer, struct gpu_scene *scene, const struct tracer_update *update,
                   struct error *error)
{
    enum tracer_progress progress = TRACER_MORE;
    while (progress == TRACER_MORE)
        progress = tracer_update_step(tracer, scene, update, STEP_WITHOUT_END, error);
    return progress == TRACER_DONE;
}
