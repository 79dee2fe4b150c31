/* SPDX-License-Identifier: MIT */
/* A tracer that consists of its own folder alone: test_toy_tracer.py builds the product with it. */
#include "gpu/program.h"
#include "trace/program.h"
#include "trace/tracer.h"

#include <stdlib.h>

static struct tracer *toy_create(struct gpu_device *device, const struct tracer_options *options,
                                 struct error *error)
{
    (void)device, (void)options;
    struct tracer *toy = calloc(1, sizeof(*toy));
    if (!toy)
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the tracer toy");
    return toy;
}

static void toy_destroy(struct tracer *tracer)
{
    free(tracer);
}

static enum tracer_progress toy_update(struct tracer *tracer, struct gpu_scene *scene,
                                       const struct tracer_update *update, struct error *error)
{
    (void)update, (void)error;
    tracer->stats.nodes = scene->instance_count;
    return TRACER_DONE;
}

static void toy_tell(const struct tracer *tracer, struct structure_rows *rows)
{
    structure_number(rows, "instances_looked_at", tracer->stats.nodes);
}

static bool toy_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                            const struct ray_range *rays, struct error *error)
{
    const struct toy_settings *settings = &tracer->options.toy;
    const struct trace_program_source source = {.traverse = "toy/traverse.glsl",
                                                .rays_a_dispatch = settings->batch};
    const struct gpu_program *program = trace_program_get(scene, &state->wave, &source, error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "toy_backward", settings->order == TOY_ORDER_BACKWARD);
    trace_program_run(program, scene, rays, &source);
    return true;
}

const struct tracer_impl tracer_toy_impl = {
    .name = "toy",
    .depends_on = CHANGED_GEOMETRY | CHANGED_INSTANCES,
    .create = toy_create,
    .destroy = toy_destroy,
    .update = toy_update,
    .tell = toy_tell,
    .trace_range = toy_trace_range,
};
