// SPDX-License-Identifier: MIT
// The tracer `rayspace`: its trees over the scene, and the waves that descend them.
#include "trace/rayspace/tracer.h"

#include <stdlib.h>

static struct tracer *rayspace_create(struct gpu_device *device, const struct tracer_options *options,
                                      struct error *error)
{
    (void)options;
    struct rayspace *rayspace = calloc(1, sizeof(*rayspace));
    if (!rayspace) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer");
        return NULL;
    }
    const struct bvh_form form = {.one_order = true};
    scene_tree_init(&rayspace->tree, device, &form, &rayspace->base.stats);
    return &rayspace->base;
}

static void rayspace_abandon(struct tracer *tracer)
{
    struct rayspace *rayspace = (struct rayspace *)tracer;
    gpu_buffer_finish(rayspace->tree.store.device, &rayspace->ranks);
    scene_tree_finish(&rayspace->tree);
    tracer->stats.device_bytes = 0;
}

static void rayspace_destroy(struct tracer *tracer)
{
    rayspace_abandon(tracer);
    free(tracer);
}

/* Uploads the first primitive's rank of each instance. Ranks are 32 bits. */
static bool upload_ranks(struct rayspace *rayspace, const struct gpu_scene *scene, struct error *error)
{
    uint32_t *ranks = malloc((scene->instance_count + 1) * sizeof(*ranks));
    uint64_t rank = 0;
    if (!ranks)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %u instances", scene->instance_count);
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        ranks[i] = (uint32_t)rank;
        rank += scene->geometries[scene->instances[i].geometry].device.primitive_count;
        if (rank >= RAYSPACE_NO_RANK)
            break;
    }
    rayspace->rank_count = (uint32_t)rank;
    const size_t bytes = scene->instance_count * sizeof(*ranks);
    bool good = rank < RAYSPACE_NO_RANK;
    if (!good) {
        error_set(error, ERROR_LIMIT, "tracer", "rayspace: all instances together have more than %u primitives",
                  RAYSPACE_NO_RANK);
        error_remedy(error, "take another tracer");
    }
    good = good && gpu_buffer_upload(scene->device, &rayspace->ranks, ranks, bytes, error);
    rayspace->base.stats.uploaded_bytes += good ? bytes : 0;
    free(ranks);
    return good;
}

static enum tracer_progress rayspace_update(struct tracer *tracer, struct gpu_scene *scene,
                                            const struct tracer_update *update, struct error *error)
{
    struct rayspace *rayspace = (struct rayspace *)tracer;
    enum tracer_progress progress = TRACER_DONE;
    if (!rayspace_is_flat(&tracer->options))
        progress = scene_tree_update(&rayspace->tree, scene, update, tracer->step_end_ns, error);
    if (progress == TRACER_DONE && update->changed & (CHANGED_GEOMETRY | CHANGED_INSTANCES) &&
        !upload_ranks(rayspace, scene, error))
        progress = TRACER_FAILED;
    if (progress == TRACER_FAILED)
        rayspace_abandon(tracer);
    else
        tracer->stats.device_bytes = scene_tree_bytes(&rayspace->tree) + rayspace->ranks.capacity_bytes;
    return progress;
}

static void rayspace_report(const struct tracer *tracer, struct structure_rows *rows)
{
    scene_tree_report(&((const struct rayspace *)tracer)->tree, rows);
}

static bool rayspace_waits(struct tracer *tracer)
{
    return scene_tree_waits(&((struct rayspace *)tracer)->tree);
}

/* ---- waves ---- */

static struct trace_state *rayspace_state_create(struct gpu_device *device, const struct tracer_options *options,
                                                 struct error *error)
{
    (void)device;
    struct rayspace_state *state = calloc(1, sizeof(*state));
    if (state && options->rayspace.form == TRACER_FORM_PAPER) {
        state->sorts = RAYSPACE_CHANCE_OFF;
        state->turns = RAYSPACE_CHANCE_ON; /* section 3.5.1 */
    }
    if (state)
        return &state->base;
    error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the state of a wave");
    return NULL;
}

static void rayspace_state_destroy(struct trace_state *state)
{
    struct rayspace_state *own = (struct rayspace_state *)state;
    gpu_buffer_finish(state->device, &own->nodes);
    gpu_buffer_finish(state->device, &own->answers);
    for (unsigned i = 0; i < RAYSPACE_STACKS; i++)
        gpu_buffer_finish(state->device, &own->stacks[i]);
    gpu_buffer_finish(state->device, &own->leaves);
    gpu_buffer_finish(state->device, &own->control);
    rayspace_reduction_finish(state->device, &own->reduction);
    gpu_buffer_finish(state->device, &own->order);
    gpu_buffer_finish(state->device, &own->bins);
    gpu_buffer_finish(state->device, &own->counts);
    gpu_readback_finish(state->device, &own->copied_counts);
    gpu_buffer_finish(state->device, &own->items);
    free(own);
}

static uint64_t rayspace_state_bytes(const struct trace_state *state)
{
    const struct rayspace_state *own = (const struct rayspace_state *)state;
    uint64_t bytes = own->nodes.capacity_bytes + own->answers.capacity_bytes + own->leaves.capacity_bytes +
                     own->control.capacity_bytes + own->order.capacity_bytes + own->bins.capacity_bytes +
                     own->counts.capacity_bytes + own->copied_counts.capacity_bytes + own->items.capacity_bytes +
                     rayspace_reduction_bytes(&own->reduction);
    for (unsigned i = 0; i < RAYSPACE_STACKS; i++)
        bytes += own->stacks[i].capacity_bytes;
    return bytes;
}

static bool rayspace_trace_begin(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                                 struct error *error)
{
    return rayspace_descent_begin((struct rayspace *)tracer, scene, (struct rayspace_state *)state, error);
}

static enum tracer_progress rayspace_trace_step(struct tracer *tracer, struct gpu_scene *scene,
                                                struct trace_state *state, uint64_t step_end_ns,
                                                struct error *error)
{
    struct rayspace *rayspace = (struct rayspace *)tracer;
    struct rayspace_state *own = (struct rayspace_state *)state;
    enum tracer_progress progress = rayspace_descent_step(rayspace, scene, own, step_end_ns, error);
    if (progress == TRACER_DONE)
        progress = rayspace_descent_finish(rayspace, scene, own, error);
    return progress == TRACER_DONE ? tracer_progress_of(rayspace_counts_add(own, scene, error)) : progress;
}

const struct tracer_impl tracer_rayspace_impl = {
    .name = "rayspace",
    .depends_on = CHANGED_GEOMETRY | CHANGED_DEFORMED | CHANGED_INSTANCES,
    .create = rayspace_create,
    .destroy = rayspace_destroy,
    .update = rayspace_update,
    .abandon = rayspace_abandon,
    .report = rayspace_report,
    .waits = rayspace_waits,
    .state_create = rayspace_state_create,
    .state_destroy = rayspace_state_destroy,
    .state_device_bytes = rayspace_state_bytes,
    .state_copy_counts = rayspace_counts_copy,
    .state_report = rayspace_counts_report,
    .trace_begin = rayspace_trace_begin,
    .trace_step = rayspace_trace_step,
};
