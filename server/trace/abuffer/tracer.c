/* SPDX-License-Identifier: MIT */
/* The tracer `abuffer`: voxels that locate surfaces, and A-buffers along three axes that hold them.
 *
 * Hu, Huang, Zhang, Yuan, Li. Ray Tracing via GPU Rasterization. 2014. */
#include "gpu/timer.h"
#include "trace/abuffer/build.h"
#include "abuffer/layout.h"
#include "trace/abuffer/store.h"
#include "trace/abuffer/trace.h"
#include "trace/raster/box.h"
#include "trace/raster/draw.h"
#include "trace/raster/fit.h"
#include "trace/program.h"
#include "trace/tracer.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

/* Defaults where no resolution is requested: the maximum, and the samples that a pixel of the picture is worth.
 * A sample takes a third of the time that one of ldc takes. */
#define RESOLUTION_USUAL 1280u
#define SAMPLES_PER_PIXEL 12.0

#define VOXELS_MIN 16
#define VOXELS_MAX 256

struct abuffer {
    struct tracer base;
    struct abuffer_store store;
    struct abuffer_builder *builder;
    struct gpu_timer *timer;
    struct axes_request request; /* requested resolution */
    uint32_t voxels_along;       /* requested number; 0: chosen for the resolution */
    uint32_t fitted;             /* resolution lowered to fit memory; 0: not counted yet */
    uint32_t fitted_instances;   /* instances included in that count */
    bool had_cutout;             /* at the last build */
};

/* ---- options ---- */

/* The power of two nearest to sqrt(3 N), within bounds: the best one according to the paper, section 5. */
static uint32_t voxels_for(uint32_t resolution)
{
    uint32_t voxels = VOXELS_MIN;
    /* Rounds at 1.5 times this number, the middle between it and the next; squared. */
    while (voxels < VOXELS_MAX && 4 * 3 * resolution > 9 * voxels * voxels)
        voxels *= 2;
    return voxels;
}

/* ---- life ---- */

static void abuffer_destroy(struct tracer *tracer)
{
    struct abuffer *abuffer = (struct abuffer *)tracer;
    if (!abuffer)
        return;
    abuffer_builder_destroy(abuffer->builder);
    abuffer_store_finish(&abuffer->store);
    gpu_timer_destroy(abuffer->timer);
    free(abuffer);
}

static struct tracer *abuffer_create(struct gpu_device *device, const struct tracer_options *options,
                                     struct error *error)
{
    struct abuffer *abuffer = calloc(1, sizeof(*abuffer));
    if (!abuffer) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer");
        return NULL;
    }
    abuffer_store_init(&abuffer->store, device);
    abuffer->request = (struct axes_request){options->abuffer.resolution, RESOLUTION_USUAL, SAMPLES_PER_PIXEL};
    abuffer->voxels_along = options->abuffer.voxels;
    abuffer->timer = gpu_timer_create(device);
    if (!abuffer->timer)
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer's timer");
    abuffer->builder = abuffer->timer ? abuffer_builder_create(device, error) : NULL;
    if (abuffer->builder)
        return &abuffer->base;
    abuffer_destroy(&abuffer->base);
    return NULL;
}

/* ---- updates ---- */

/* Counts the scene's layers before anything is built. `box`: the cube at the greatest resolution. */
static bool fit(struct abuffer *abuffer, const struct gpu_scene *scene, const uint32_t *instances, uint32_t count,
                const struct axes_box *box, struct error *error)
{
    const struct axes_box whole = axes_box_whole(box, axes_greatest_resolution(&abuffer->request));
    const float steep = abuffer->base.options.abuffer.form == TRACER_FORM_PAPER ? 0 : ABUFFER_STEEP;
    const struct axes_layers layers = axes_count_layers(scene, instances, count, 0, steep, &whole);
    uint32_t fitted = axes_choose_resolution(&abuffer->base, layers.mean, &abuffer->request);
    if (!axes_fit_resolution(&abuffer->base, layers.mean, &fitted, error))
        return false;
    abuffer->fitted = fitted;
    abuffer->fitted_instances = count;
    return true;
}

/* Voxels for the resolution before it was lowered: a lower resolution makes images cheaper, but with fewer
 * voxels a ray passes more samples (gears of 28 layers, 543 texels: 64 voxels take 0.7 of the time of 32). */
static uint32_t voxels_of(const struct abuffer *abuffer)
{
    uint32_t voxels = abuffer->voxels_along;
    if (voxels == 0)
        voxels = voxels_for(axes_greatest_resolution(&abuffer->request));
    while (voxels > abuffer->fitted && voxels > VOXELS_MIN)
        voxels /= 2;
    return voxels;
}

/* Places the cube round all instances that are drawn. */
static bool place(struct abuffer *abuffer, const struct gpu_scene *scene, const uint32_t *instances,
                  uint32_t count, struct error *error)
{
    struct abuffer_store *store = &abuffer->store;
    struct axes_box box;
    if ((abuffer->fitted == 0 || abuffer->fitted_instances != count) &&
        (!axes_box_place(&box, scene, instances, count, axes_greatest_resolution(&abuffer->request), error) ||
         !fit(abuffer, scene, instances, count, &box, error)))
        return false;
    if (!axes_box_place(&box, scene, instances, count, abuffer->fitted, error))
        return false;
    memcpy(store->lower_world, box.lower_world, sizeof(store->lower_world));
    store->cell_world = box.cell_world;
    store->resolution = abuffer->fitted;
    store->resolution_wanted = axes_wanted_resolution(&abuffer->base, &abuffer->request);
    store->voxels_along = voxels_of(abuffer);
    return true;
}

static bool begin(struct abuffer *abuffer, struct gpu_scene *scene, struct error *error)
{
    uint32_t *instances = NULL, count = 0;
    bool begun = axes_list_instances(scene, &instances, &count, error) &&
                 place(abuffer, scene, instances, count, error) &&
                 abuffer_build_begin(abuffer->builder, &abuffer->store, scene, instances, count,
                                     &abuffer->base.options, error);
    free(instances);
    if (!begun)
        return false;
    abuffer->had_cutout = scene->has_cutout;
    abuffer->base.stats.uploaded_bytes = (uint64_t)abuffer->store.drawn_count * AXES_INSTANCE_BYTES;
    return true;
}

static void fill_stats(struct abuffer *abuffer)
{
    struct tracer_stats *stats = &abuffer->base.stats;
    const struct abuffer_store *store = &abuffer->store;
    stats->nodes = store->sample_count;
    stats->device_bytes = abuffer_store_bytes(store) + abuffer_builder_bytes(abuffer->builder);
}

static enum tracer_progress do_step(struct abuffer *abuffer, struct gpu_scene *scene, struct stage_times *times,
                                    struct error *error)
{
    enum tracer_progress progress = TRACER_FAILED;
    gpu_timer_begin(abuffer->timer, STAGE_BUILD, 0);
    if (abuffer_build_is_on(abuffer->builder) || begin(abuffer, scene, error))
        progress = abuffer_build_step(abuffer->builder, abuffer->base.step_end_ns, error);
    gpu_finish(abuffer->base.device); /* CPU time of the build includes the device's */
    gpu_timer_end(abuffer->timer);
    gpu_timer_collect(abuffer->timer, times);
    return progress;
}

static enum tracer_progress abuffer_update(struct tracer *tracer, struct gpu_scene *scene,
                                           const struct tracer_update *update, struct error *error)
{
    struct abuffer *abuffer = (struct abuffer *)tracer;
    struct tracer_stats *stats = &tracer->stats;
    /* Cutouts are the only part of a surface that the structure depends on. */
    if (!abuffer_build_is_on(abuffer->builder) && update->changed == CHANGED_SURFACES && !scene->has_cutout &&
        !abuffer->had_cutout)
        return TRACER_DONE;
    if (!abuffer_build_is_on(abuffer->builder) && update->changed & CHANGED_GEOMETRY)
        abuffer->fitted = 0;
    enum tracer_progress progress = do_step(abuffer, scene, update->times, error);
    if (progress == TRACER_FAILED) {
        abuffer_store_finish(&abuffer->store);
        abuffer_builder_clear(abuffer->builder);
    }
    if (progress == TRACER_DONE) {
        stats->nodes_rebuilt = abuffer->store.sample_count;
        stats->parts_built = 1;
    }
    fill_stats(abuffer);
    return progress;
}

static void abuffer_abandon(struct tracer *tracer)
{
    struct abuffer *abuffer = (struct abuffer *)tracer;
    abuffer_build_abandon(abuffer->builder);
    abuffer_builder_clear(abuffer->builder);
    fill_stats(abuffer);
}

static void abuffer_report(const struct tracer *tracer, struct structure_rows *rows)
{
    const struct abuffer_store *store = &((const struct abuffer *)tracer)->store;
    if (store->resolution == 0)
        return;
    axes_fit_warn(structure_number(rows, "resolution", store->resolution), store->resolution_wanted);
    structure_metres(rows, "cell", store->cell_world);
    structure_number(rows, "samples", store->sample_count);
    structure_number(rows, "longest_list", store->depth_max);
    structure_built(rows, tracer->stats.parts_built != 0);
}

static bool abuffer_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                                const struct ray_range *rays, struct error *error)
{
    (void)state;
    return abuffer_intersect(&((struct abuffer *)tracer)->store, scene, rays, &tracer->options, error);
}

static void abuffer_announce(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave)
{
    const struct ray_range rays = {.wave = wave, .end = wave->ray_count};
    (void)abuffer_intersect(&((struct abuffer *)tracer)->store, scene, &rays, &tracer->options, NULL);
}

static bool abuffer_make_surfaces(struct tracer *tracer, struct gpu_scene *scene, const struct ray_range *rays,
                                  struct error *error)
{
    return abuffer_surfaces(&((struct abuffer *)tracer)->store, scene, rays, error);
}

const struct tracer_impl tracer_abuffer_impl = {
    .name = "abuffer",
    .depends_on = CHANGED_GEOMETRY | CHANGED_DEFORMED | CHANGED_INSTANCES | CHANGED_SURFACES,
    .still = true,
    .minimum_rays = TRACE_RAYS_MULTIPLE,
    .create = abuffer_create,
    .destroy = abuffer_destroy,
    .update = abuffer_update,
    .abandon = abuffer_abandon,
    .report = abuffer_report,
    .trace_range = abuffer_trace_range,
    .announce = abuffer_announce,
    .surfaces = abuffer_make_surfaces,
};
