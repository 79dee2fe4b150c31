/* SPDX-License-Identifier: MIT */
/* The tracer `quadtree`: quadtrees over the surfaces that a view sees.
 *
 * Widmer, Pajak, Schulz, Pulli, Kautz, Goesele, Luebke. An Adaptive Acceleration Structure for Screen-space Ray
 * Tracing. 2015. */
#include "gpu/timer.h"
#include "trace/program.h"
#include "trace/quadtree/eyes.h"
#include "trace/quadtree/layers.h"
#include "trace/quadtree/nodes.h"
#include "trace/quadtree/store.h"
#include "trace/quadtree/trace.h"
#include "trace/tracer.h"

#include <stdlib.h>

/* Phases of a build, which are also parts of STAGE_BUILD: what the next unit does. */
enum quadtree_phase { QUADTREE_IDLE, QUADTREE_DRAW, QUADTREE_BUILD };

struct quadtree {
    struct tracer base;
    enum quadtree_phase phase;
    struct quadtree_store store;
    struct quadtree_layers layers;
    struct quadtree_node_build nodes;
    struct trace_view texels; /* pixels are texels of the structure, if that is of one view */
    struct gpu_timer *timer;
};

/* ---- life ---- */

static void quadtree_destroy(struct tracer *tracer)
{
    struct quadtree *quadtree = (struct quadtree *)tracer;
    if (!quadtree)
        return;
    quadtree_layers_finish(&quadtree->layers);
    quadtree_nodes_finish(&quadtree->nodes, quadtree->store.device);
    quadtree_store_finish(&quadtree->store);
    gpu_timer_destroy(quadtree->timer);
    free(quadtree);
}

static struct tracer *quadtree_create(struct gpu_device *device, const struct tracer_options *options,
                                      struct error *error)
{
    (void)options;
    struct quadtree *quadtree = calloc(1, sizeof(*quadtree));
    if (!quadtree) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer");
        return NULL;
    }
    quadtree->store.device = device;
    quadtree->timer = gpu_timer_create(device);
    if (quadtree->timer)
        return &quadtree->base;
    error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer's timer");
    quadtree_destroy(&quadtree->base);
    return NULL;
}

/* ---- updates ---- */

static void reset(struct quadtree *quadtree)
{
    quadtree->phase = QUADTREE_IDLE;
    quadtree_layers_finish(&quadtree->layers);
    quadtree_nodes_finish(&quadtree->nodes, quadtree->store.device);
    quadtree_store_finish(&quadtree->store);
}

static void fill_stats(struct quadtree *quadtree)
{
    const struct quadtree_uniforms *u = &quadtree->store.uniforms;
    struct tracer_stats *stats = &quadtree->base.stats;
    stats->nodes = quadtree_nodes_count(u);
    stats->device_bytes = quadtree_store_bytes(&quadtree->store) + quadtree_layers_bytes(&quadtree->layers) +
                          quadtree_nodes_bytes(&quadtree->nodes);
}

static bool begin_update(struct quadtree *quadtree, const struct gpu_scene *scene, const struct trace_view *view,
                         struct error *error)
{
    const struct quadtree_settings *settings = &quadtree->base.options.quadtree;
    quadtree->store.only_leaves = quadtree->base.options.quadtree_leaves != 0;
    if (!quadtree_store_place(&quadtree->store, scene, view, settings, error))
        return false;
    quadtree_texel_view(&quadtree->texels, view, settings);
    quadtree->phase = QUADTREE_DRAW;
    return quadtree_layers_begin(&quadtree->layers, &quadtree->store, error);
}

static enum tracer_progress do_unit(struct quadtree *quadtree, struct gpu_scene *scene, struct error *error)
{
    const bool at_once = quadtree->base.step_end_ns == STEP_WITHOUT_END;
    if (quadtree->phase == QUADTREE_BUILD)
        return quadtree_nodes_step(&quadtree->nodes, &quadtree->store, scene, error);
    const enum tracer_progress progress = quadtree_layers_step(&quadtree->layers, scene, at_once, error);
    if (progress != TRACER_DONE)
        return progress;
    quadtree->phase = QUADTREE_BUILD;
    return quadtree_nodes_begin(&quadtree->nodes, &quadtree->store, error) ? TRACER_MORE : TRACER_FAILED;
}

/* Runs units of one phase, and waits for the device so that the CPU's clock measures them. */
static enum tracer_progress run_phase(struct quadtree *quadtree, struct gpu_scene *scene, struct error *error)
{
    const uint64_t step_end_ns = quadtree->base.step_end_ns;
    const enum quadtree_phase phase = quadtree->phase;
    enum tracer_progress progress = TRACER_MORE;
    gpu_timer_begin(quadtree->timer, STAGE_BUILD, phase == QUADTREE_BUILD);
    do {
        progress = do_unit(quadtree, scene, error);
        if (step_end_ns != STEP_WITHOUT_END || quadtree->phase != phase)
            gpu_finish(quadtree->base.device);
    } while (progress == TRACER_MORE && quadtree->phase == phase && !step_is_over(step_end_ns));
    gpu_timer_end(quadtree->timer);
    return progress;
}

static enum tracer_progress quadtree_update(struct tracer *tracer, struct gpu_scene *scene,
                                            const struct tracer_update *update, struct error *error)
{
    struct quadtree *quadtree = (struct quadtree *)tracer;
    enum tracer_progress progress = TRACER_MORE;
    if (quadtree->phase == QUADTREE_IDLE && !begin_update(quadtree, scene, update->view, error))
        progress = TRACER_FAILED;
    gpu_scene_bind(scene);
    while (progress == TRACER_MORE) {
        progress = run_phase(quadtree, scene, error);
        if (step_is_over(tracer->step_end_ns))
            break;
    }
    gpu_timer_collect(quadtree->timer, update->times);
    if (progress == TRACER_FAILED)
        reset(quadtree);
    fill_stats(quadtree);
    if (progress == TRACER_DONE) {
        quadtree->phase = QUADTREE_IDLE;
        tracer->stats.nodes_rebuilt = tracer->stats.nodes;
        tracer->stats.parts_built = 1;
    }
    return progress;
}

static void quadtree_abandon(struct tracer *tracer)
{
    reset((struct quadtree *)tracer);
    fill_stats((struct quadtree *)tracer);
}

static void quadtree_report(const struct tracer *tracer, struct structure_rows *rows)
{
    const struct quadtree_uniforms *u = &((const struct quadtree *)tracer)->store.uniforms;
    const struct quadtree_settings *settings = &tracer->options.quadtree;
    if (u->faces == 0)
        return;
    structure_number(rows, "faces", u->faces);
    structure_number(rows, "width", u->width);
    structure_number(rows, "height", u->height);
    structure_number(rows, "layers", u->layers);
    structure_number(rows, "nodes", tracer->stats.nodes);
    structure_pixels(rows, "bound", settings->pixels);
    structure_metres(rows, "bound_radius", settings->radius);
    structure_built(rows, tracer->stats.parts_built != 0);
}

/* ---- waves ---- */

static bool trace_begin(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                        struct error *error)
{
    (void)tracer, (void)scene;
    return quadtree_trace_begin(state, error);
}

static bool trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                        const struct ray_range *rays, struct error *error)
{
    return quadtree_intersect(&((struct quadtree *)tracer)->store, scene, (struct quadtree_state *)state, rays,
                              &tracer->options, error);
}

static void announce(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave)
{
    quadtree_announce(scene, wave, &tracer->options);
}

static bool texel_view(const struct tracer *tracer, struct trace_view *texels, uint32_t *layers)
{
    const struct quadtree *quadtree = (const struct quadtree *)tracer;
    *texels = quadtree->texels;
    *layers = quadtree->store.uniforms.layers;
    return tracer->options.quadtree.faces == QUADTREE_FACES_VIEW && quadtree->store.uniforms.faces == 1;
}

static bool layer_hits(struct tracer *tracer, struct gpu_scene *scene, const struct ray_range *rays,
                       uint32_t layer, struct error *error)
{
    return quadtree_layer_hits(&((struct quadtree *)tracer)->store, scene, rays, layer, error);
}

static bool finds_eyes(const struct tracer *tracer, const struct gpu_scene *scene,
                       const struct frame_uniforms *frame)
{
    return quadtree_finds_eyes(&((const struct quadtree *)tracer)->store, scene, frame, &tracer->options);
}

static bool eye_hits(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                     const struct eye_rays *rays, struct error *error)
{
    (void)scene;
    return quadtree_eye_hits(&((struct quadtree *)tracer)->store, (struct quadtree_state *)state, rays, error);
}

const struct tracer_impl tracer_quadtree_impl = {
    .name = "quadtree",
    .depends_on =
        CHANGED_GEOMETRY | CHANGED_DEFORMED | CHANGED_INSTANCES | CHANGED_SURFACES | CHANGED_DISCS | CHANGED_VIEW,
    .still = true,
    .minimum_rays = TRACE_RAYS_MULTIPLE,
    .create = quadtree_create,
    .destroy = quadtree_destroy,
    .update = quadtree_update,
    .abandon = quadtree_abandon,
    .report = quadtree_report,
    .state_create = quadtree_state_create,
    .state_destroy = quadtree_state_destroy,
    .state_device_bytes = quadtree_state_device_bytes,
    .state_copy_counts = quadtree_state_copy_counts,
    .state_report = quadtree_state_report,
    .trace_begin = trace_begin,
    .trace_range = trace_range,
    .announce = announce,
    .texel_view = texel_view,
    .layer_hits = layer_hits,
    .finds_eyes = finds_eyes,
    .eye_hits = eye_hits,
};
