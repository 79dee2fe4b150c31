/* SPDX-License-Identifier: MIT */
/* Brute force: every primitive for every ray. For tests: it has no structure that could be wrong. */
#include "trace/trace_program.h"
#include "trace/tracer.h"

#include <stdlib.h>

static const struct gpu_define naive_defines[] = {{"TRACER_NAIVE", "1"}, {0}};
static const struct trace_program_source naive_source = {
    .traverse = "naive/traverse.glsl",
    .defines = naive_defines,
};

static struct tracer *naive_create(struct gpu_device *device, const struct tracer_options *options,
                                   struct error *error)
{
    (void)device, (void)options;
    struct tracer *tracer = calloc(1, sizeof(*tracer));
    if (!tracer)
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the naive tracer");
    return tracer;
}

static void naive_destroy(struct tracer *tracer)
{
    free(tracer);
}

static bool naive_update(struct tracer *tracer, struct scene_gpu *scene, const struct scene_changes *changes,
                         struct stage_times *times, struct error *error)
{
    (void)scene, (void)changes, (void)times, (void)error;
    tracer->stats = (struct tracer_stats){0}; /* there is nothing but the scene itself */
    return true;
}

static bool naive_trace(struct tracer *tracer, struct scene_gpu *scene, const struct wave *wave,
                        struct error *error)
{
    (void)tracer;
    const struct gpu_program *program = trace_program_get(scene, wave->kind, &naive_source, error);
    if (!program)
        return false;
    trace_program_run(program, scene, wave, &naive_source);
    return true;
}

const struct tracer_impl tracer_naive_impl = {
    .name = "naive",
    .depends_on = 0,
    .create = naive_create,
    .destroy = naive_destroy,
    .update = naive_update,
    .trace = naive_trace,
};
