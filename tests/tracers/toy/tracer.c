/* SPDX-License-Identifier: MIT */
/* A tracer with a folder of its own and nothing anywhere else: what the test that adds one adds. */
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
                                       const struct scene_changes *changes, struct stage_times *times,
                                       struct error *error)
{
    (void)tracer, (void)scene, (void)changes, (void)times, (void)error;
    return TRACER_DONE;
}

static bool toy_trace(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, struct error *error)
{
    const struct toy_settings *settings = &tracer->options.toy;
    const struct trace_program_source source = {.traverse = "toy/traverse.glsl",
                                                .rays_a_dispatch = settings->batch};
    const struct gpu_program *program = trace_program_get(scene, wave, &source, error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "toy_backward", settings->order == TOY_ORDER_BACKWARD);
    return trace_program_run(program, scene, wave, &source, error);
}

const struct tracer_impl tracer_toy_impl = {
    .name = "toy",
    .depends_on = TRACER_NEEDS_SCENE,
    .create = toy_create,
    .destroy = toy_destroy,
    .update = toy_update,
    .trace = toy_trace,
};
