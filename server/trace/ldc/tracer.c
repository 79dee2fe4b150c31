/* SPDX-License-Identifier: MIT */
/* The tracer `ldc`: layered depth cubes, one of static and one of dynamic instances (ldc/parts.h).
 *
 * Bürger, Hertel, Krüger, Westermann. GPU Rendering of Secondary Effects. 2007. */
#include "gpu/timer.h"
#include "ldc/layout.h"
#include "trace/raster/draw.h"
#include "trace/raster/fit.h"
#include "trace/ldc/build.h"
#include "trace/ldc/levels.h"
#include "trace/ldc/parts.h"
#include "trace/ldc/store.h"
#include "trace/ldc/surface.h"
#include "trace/ldc/trace.h"
#include "trace/program.h"
#include "trace/tracer.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

/* Defaults where no resolution is requested: the maximum, and the samples that a pixel of the picture is worth.
 * Building one sample takes about as long as bvh takes for a ray (software GL: 0.35 microseconds of a
 * processor), and a pixel has 16 rays and more. */
#define RESOLUTION_USUAL 1024u
#define SAMPLES_PER_PIXEL 4.0

/* Phases of an update: what its next unit does. */
enum ldc_phase {
    LDC_IDLE,
    LDC_CUBE, /* begins a cube */
    LDC_SAMPLES,
    LDC_LEVELS,
};

struct ldc {
    struct tracer base;
    enum ldc_phase phase;
    unsigned which;            /* the current cube */
    bool stale[LDC_CUBES_MAX]; /* cubes that this update builds */
    struct ldc_levels levels;  /* levels in the making */
    struct ldc_store store;
    struct ldc_builder *builder;
    struct ldc_parts parts;
    struct gpu_timer *timer;
    struct axes_request request;
};

/* ---- options ---- */

static bool check_options(const struct tracer_options *options, struct error *error)
{
    if (options->limits.ldc_layers > LDC_LAYERS_MAX)
        return error_set(error, ERROR_INVALID, "options.ldc_layers", "%u layers; at most %u can be kept",
                         options->limits.ldc_layers, LDC_LAYERS_MAX);
    return true;
}

/* ---- life ---- */

static void ldc_destroy(struct tracer *tracer)
{
    struct ldc *ldc = (struct ldc *)tracer;
    if (!ldc)
        return;
    ldc_parts_finish(&ldc->parts);
    ldc_levels_finish(&ldc->levels);
    ldc_builder_destroy(ldc->builder);
    ldc_store_finish(&ldc->store);
    gpu_timer_destroy(ldc->timer);
    free(ldc);
}

static struct tracer *ldc_create(struct gpu_device *device, const struct tracer_options *options,
                                 struct error *error)
{
    if (!check_options(options, error))
        return NULL;
    struct ldc *ldc = calloc(1, sizeof(*ldc));
    if (!ldc) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer");
        return NULL;
    }
    ldc_store_init(&ldc->store, device);
    ldc->request = (struct axes_request){options->ldc.resolution, RESOLUTION_USUAL, SAMPLES_PER_PIXEL};
    ldc->timer = gpu_timer_create(device);
    if (!ldc->timer)
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer's timer");
    ldc->builder = ldc->timer ? ldc_builder_create(device, error) : NULL;
    if (ldc->builder)
        return &ldc->base;
    ldc_destroy(&ldc->base);
    return NULL;
}

/* Drops everything after a failure; the next update rebuilds it. */
static void reset(struct ldc *ldc)
{
    struct gpu_device *device = ldc->store.device;
    ldc->phase = LDC_IDLE;
    ldc_levels_finish(&ldc->levels);
    ldc_builder_clear(ldc->builder);
    ldc_parts_finish(&ldc->parts);
    ldc_store_finish(&ldc->store);
    ldc_store_init(&ldc->store, device);
}

/* ---- updates ---- */

/* Advances ldc->which to the next cube that must be built and has instances. */
static enum tracer_progress find_cube(struct ldc *ldc)
{
    for (; ldc->which < LDC_CUBES_MAX; ldc->which++) {
        const struct ldc_part *part = &ldc->parts.parts[ldc->which];
        struct ldc_cube *cube = &ldc->store.cubes[ldc->which];
        if (!ldc->stale[ldc->which])
            continue;
        *cube = (struct ldc_cube){.cell_world = part->box.cell_world};
        memcpy(cube->lower_world, part->box.lower_world, sizeof(cube->lower_world));
        if (part->count == 0)
            continue;
        cube->resolution = part->resolution;
        cube->resolution_wanted = axes_wanted_resolution(&ldc->base, &ldc->request);
        ldc->phase = LDC_CUBE;
        return TRACER_MORE;
    }
    return TRACER_DONE;
}

static enum tracer_progress begin_cube(struct ldc *ldc, struct gpu_scene *scene, struct error *error)
{
    const struct ldc_part *part = &ldc->parts.parts[ldc->which];
    ldc->phase = LDC_SAMPLES;
    return ldc_build_begin(ldc->builder, &ldc->store, ldc->which, scene, part->instances, part->count,
                           &ldc->base.options, error);
}

static enum tracer_progress end_cube(struct ldc *ldc)
{
    struct tracer_stats *stats = &ldc->base.stats;
    stats->nodes_rebuilt += ldc->store.cubes[ldc->which].node_count;
    stats->uploaded_bytes += (uint64_t)ldc->parts.parts[ldc->which].count * AXES_INSTANCE_BYTES;
    stats->parts_built |= 1u << ldc->which;
    ldc->which++;
    return find_cube(ldc);
}

static enum tracer_progress do_unit(struct ldc *ldc, struct gpu_scene *scene, struct error *error)
{
    if (ldc->phase == LDC_CUBE)
        return begin_cube(ldc, scene, error);
    const bool at_once = ldc->base.step_end_ns == STEP_WITHOUT_END;
    enum tracer_progress progress = ldc->phase == LDC_SAMPLES ? ldc_build_step(ldc->builder, at_once, error)
                                                              : ldc_levels_step(&ldc->levels, error);
    if (progress != TRACER_DONE)
        return progress;
    if (ldc->phase == LDC_LEVELS)
        return end_cube(ldc);
    ldc->phase = LDC_LEVELS;
    ldc_levels_begin(&ldc->levels, &ldc->store, ldc->which, &ldc->base.options);
    return TRACER_MORE;
}

/* Runs units of one cube, and waits for the device so that the CPU's clock measures them. */
static enum tracer_progress run_cube(struct ldc *ldc, struct gpu_scene *scene, struct error *error)
{
    const uint64_t step_end_ns = ldc->base.step_end_ns;
    const unsigned which = ldc->which;
    enum tracer_progress progress = TRACER_MORE;
    gpu_timer_begin(ldc->timer, STAGE_BUILD, which);
    do {
        progress = do_unit(ldc, scene, error);
        if (step_end_ns != STEP_WITHOUT_END || ldc->which != which)
            gpu_finish(ldc->base.device);
    } while (progress == TRACER_MORE && ldc->which == which && !step_is_over(step_end_ns));
    gpu_timer_end(ldc->timer);
    return progress;
}

static enum tracer_progress run_cubes(struct ldc *ldc, struct gpu_scene *scene, struct stage_times *times,
                                      struct error *error)
{
    enum tracer_progress progress = TRACER_MORE;
    gpu_scene_bind(scene);
    do
        progress = run_cube(ldc, scene, error);
    while (progress == TRACER_MORE && !step_is_over(ldc->base.step_end_ns));
    gpu_timer_collect(ldc->timer, times);
    return progress;
}

static void fill_stats(struct ldc *ldc)
{
    struct tracer_stats *stats = &ldc->base.stats;
    stats->nodes = 0;
    for (int i = 0; i < LDC_CUBES_MAX; i++) {
        const struct ldc_cube *cube = &ldc->store.cubes[i];
        stats->nodes += cube->resolution ? cube->node_count : 0;
    }
    stats->device_bytes =
        ldc_store_bytes(&ldc->store) + ldc_builder_bytes(ldc->builder) + ldc_levels_bytes(&ldc->levels);
}

/* Determines the cubes to build. A change of materials does not say which instances use them. */
static enum tracer_progress begin_update(struct ldc *ldc, const struct gpu_scene *scene, unsigned changed,
                                         struct error *error)
{
    const struct ldc_parts_settings settings = {
        .tracer = &ldc->base,
        .request = ldc->request,
        .overlap = ldc->base.options.ldc.form == TRACER_FORM_PAPER ? 1.0f : AXES_OVERLAP,
    };
    bool any = changed & CHANGED_SURFACES;
    if (!ldc_parts_update(&ldc->parts, scene, &settings, changed & CHANGED_GEOMETRY, ldc->stale, error))
        return TRACER_FAILED;
    for (unsigned i = 0; i < LDC_CUBES_MAX; i++) {
        any = any || ldc->stale[i]; /* building a cube overwrites the cubes behind it */
        ldc->stale[i] = any;
    }
    ldc->which = 0;
    return find_cube(ldc);
}

static enum tracer_progress ldc_update(struct tracer *tracer, struct gpu_scene *scene,
                                       const struct tracer_update *update, struct error *error)
{
    struct ldc *ldc = (struct ldc *)tracer;
    enum tracer_progress progress = TRACER_MORE;
    if (ldc->phase == LDC_IDLE)
        progress = begin_update(ldc, scene, update->changed, error);
    if (progress == TRACER_MORE)
        progress = run_cubes(ldc, scene, update->times, error);
    if (progress == TRACER_FAILED)
        reset(ldc);
    if (progress == TRACER_DONE)
        ldc->phase = LDC_IDLE;
    fill_stats(ldc);
    return progress;
}

static void ldc_abandon(struct tracer *tracer)
{
    struct ldc *ldc = (struct ldc *)tracer;
    reset(ldc);
    fill_stats(ldc);
}

static void ldc_report(const struct tracer *tracer, struct structure_rows *rows)
{
    for (unsigned i = 0; i < LDC_CUBES_MAX; i++)
        ldc_cube_report(&((const struct ldc *)tracer)->store, i, tracer->stats.parts_built >> i & 1, rows);
}

static bool ldc_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                            const struct ray_range *rays, struct error *error)
{
    (void)state;
    return ldc_intersect(&((struct ldc *)tracer)->store, scene, rays, &tracer->options, error);
}

static void ldc_announce(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave)
{
    const struct ray_range rays = {.wave = wave, .end = wave->ray_count};
    (void)ldc_intersect(&((struct ldc *)tracer)->store, scene, &rays, &tracer->options, NULL);
}

static bool ldc_make_surfaces(struct tracer *tracer, struct gpu_scene *scene, const struct ray_range *rays,
                              struct error *error)
{
    return ldc_surfaces(&((struct ldc *)tracer)->store, scene, rays, error);
}

const struct tracer_impl tracer_ldc_impl = {
    .name = "ldc",
    .depends_on = CHANGED_GEOMETRY | CHANGED_DEFORMED | CHANGED_INSTANCES | CHANGED_SURFACES,
    .sampled = true,
    .still = true,
    .minimum_rays = TRACE_RAYS_MULTIPLE,
    .create = ldc_create,
    .destroy = ldc_destroy,
    .update = ldc_update,
    .abandon = ldc_abandon,
    .report = ldc_report,
    .trace_range = ldc_trace_range,
    .announce = ldc_announce,
    .surfaces = ldc_make_surfaces,
};
