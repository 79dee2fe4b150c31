/* SPDX-License-Identifier: MIT */
/* Brute force: every primitive for every ray. For tests: it has no structure that could be wrong. */
#include "trace/program.h"
#include "trace/tracer.h"

#include <stdlib.h>

/* Rays times primitives of one dispatch: well below a second on a GPU, whose driver may end what takes longer. */
#define DISPATCH_TESTS_MAX ((uint64_t)1 << 33)
#define DISPATCH_RAYS_MIN 256u
/* Software GL (llvmpipe) leaves the loops of an invocation after 65535 rounds in all, without a word; what lies
 * behind would be missed. Materials that are evaluated at an intersection have loops of their own, whose rounds
 * count for each primitive, hit or not: five were measured. */
#define SOFTWARE_ROUNDS_MAX 65000u
#define ROUNDS_WITH_MATERIALS 8u

static const struct gpu_define naive_defines[] = {{"TRACER_NAIVE", "1"}, {0}};

struct naive {
    struct tracer base;
    uint32_t rays_a_dispatch;
};

static struct tracer *naive_create(struct gpu_device *device, const struct tracer_options *options,
                                   struct error *error)
{
    (void)device, (void)options;
    struct naive *naive = calloc(1, sizeof(*naive));
    if (naive)
        return &naive->base;
    error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the naive tracer");
    return NULL;
}

static void naive_destroy(struct tracer *tracer)
{
    free(tracer);
}

static enum tracer_progress naive_update(struct tracer *tracer, struct gpu_scene *scene,
                                         const struct tracer_update *update, struct error *error)
{
    (void)update;
    uint64_t primitives = 1;
    for (uint32_t i = 0; i < scene->instance_count; i++)
        primitives += scene->geometries[scene->instances[i].geometry].device.primitive_count;
    uint64_t rounds = scene->has_cutout || scene->has_translucent ? ROUNDS_WITH_MATERIALS : 1;
    if (tracer->device->facts.software && primitives * rounds > SOFTWARE_ROUNDS_MAX) {
        error_set(error, ERROR_LIMIT, "tracer",
                  "naive: %llu primitives; on software GL it can look at %u in this scene",
                  (unsigned long long)primitives - 1, SOFTWARE_ROUNDS_MAX / (unsigned)rounds);
        error_remedy(error, "take another tracer");
        return TRACER_FAILED;
    }
    uint64_t rays = DISPATCH_TESTS_MAX / primitives;
    ((struct naive *)tracer)->rays_a_dispatch = rays > UINT32_MAX          ? UINT32_MAX
                                                : rays < DISPATCH_RAYS_MIN ? DISPATCH_RAYS_MIN
                                                                           : (uint32_t)rays;
    return TRACER_DONE;
}

static bool naive_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                              const struct ray_range *rays, struct error *error)
{
    const struct trace_program_source source = {
        .traverse = "naive/traverse.glsl",
        .defines = naive_defines,
        .rays_a_dispatch = ((struct naive *)tracer)->rays_a_dispatch,
    };
    const struct gpu_program *program = trace_program_get(scene, &state->wave, &source, error);
    if (program)
        trace_program_run(program, scene, rays, &source);
    return program != NULL;
}

const struct tracer_impl tracer_naive_impl = {
    .name = "naive",
    .depends_on = CHANGED_GEOMETRY | CHANGED_INSTANCES | CHANGED_SHADING, /* what limits it */
    .minimum_rays = 192,
    .create = naive_create,
    .destroy = naive_destroy,
    .update = naive_update,
    .trace_range = naive_trace_range,
};
