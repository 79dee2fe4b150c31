/* SPDX-License-Identifier: MIT */
/* Brute force: every primitive for every ray. For tests: it has no structure that could be wrong. */
#include "trace/naive/parts.h"

#include "shared/bindings.h"
#include "trace/program.h"
#include "trace/tracer.h"

#include <epoxy/gl.h>
#include <stdlib.h>

/* Maximum of tests (rays times primitives) in a dispatch, which the slowest GPUs take a second for, and of
 * tests of one ray, which run one after the other. */
#define DISPATCH_TESTS_MAX ((uint64_t)1 << 30)
/* Software GL (llvmpipe) leaves the loops of an invocation after 65535 rounds in all, silently; primitives beyond
 * that would be missed. Materials that are evaluated at an intersection have loops of their own, whose rounds
 * count for each primitive, hit or not: five were measured. */
#define ROUNDS_WITH_MATERIALS 8u

struct naive {
    struct tracer base;
    uint32_t ray_tests_max;   /* maximum in one dispatch */
    bool has_parts;           /* primitives need more than one part */
    struct gpu_buffer depths; /* optical depths of a dispatch's rays, kept between two parts */
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
    struct naive *naive = (struct naive *)tracer;
    if (tracer->device)
        gpu_buffer_finish(tracer->device, &naive->depths);
    free(naive);
}

static enum tracer_progress naive_update(struct tracer *tracer, struct gpu_scene *scene,
                                         const struct tracer_update *update, struct error *error)
{
    (void)update;
    struct naive *naive = (struct naive *)tracer;
    const struct gpu_facts *facts = &tracer->device->facts;
    const uint32_t rounds = scene->has_cutout || scene->has_translucent ? ROUNDS_WITH_MATERIALS : 1;
    uint64_t primitives = 0;
    for (uint32_t i = 0; i < scene->instance_count; i++)
        primitives += scene->geometries[scene->instances[i].geometry].device.primitive_count;
    if (facts->primitives_max && primitives > facts->primitives_max) {
        error_set(error, ERROR_LIMIT, "tracer", "naive: %llu primitives; on this device it can test %u",
                  (unsigned long long)primitives, facts->primitives_max);
        error_remedy(error, "take another tracer");
        return TRACER_FAILED;
    }
    naive->ray_tests_max = facts->ray_tests_max / rounds;
    naive->has_parts = primitives + scene->instance_count > naive->ray_tests_max;
    return TRACER_DONE;
}

/* Traces a range of rays through all parts of the primitives. */
static void trace_parts(const struct naive *naive, const struct gpu_program *program,
                        const struct gpu_scene *scene, const struct ray_range *rays,
                        const struct trace_program_source *source)
{
    struct naive_part part = {0};
    naive_next_part(scene, naive->ray_tests_max, &part); /* a scene of discs alone has a part too */
    gpu_uniform_uint(program, "is_first_part", 1);
    do {
        gpu_uniform_uint(program, "part_first_instance", part.first_instance);
        gpu_uniform_uint(program, "part_first_primitive", part.first_primitive);
        gpu_uniform_uint(program, "part_tests", part.tests);
        trace_program_run(program, scene, rays, source);
        gpu_uniform_uint(program, "is_first_part", 0);
        if (naive->has_parts)
            glFlush(); /* makes the driver submit it: drivers may gather commands into one batch */
    } while (naive_next_part(scene, naive->ray_tests_max, &part));
}

static bool naive_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                              const struct ray_range *rays, struct error *error)
{
    struct naive *naive = (struct naive *)tracer;
    const struct gpu_define defines[] = {{naive->has_parts ? "NAIVE_PARTS" : NULL, "1"}, {NULL, NULL}};
    const struct trace_program_source source = {.traverse = "naive/traverse.glsl", .defines = defines};
    const struct gpu_program *program = trace_program_get(scene, &state->wave, &source, error);
    struct naive_part part = {0};
    if (!program)
        return false;
    naive_next_part(scene, naive->ray_tests_max, &part); /* parts get no larger, except in a test */
    const uint32_t each = naive_rays_of(&part, DISPATCH_TESTS_MAX);
    for (uint32_t first = rays->first, count; first < rays->end; first += count) {
        count = rays->end - first < each ? rays->end - first : each;
        const struct ray_range some = {.wave = rays->wave, .first = first, .end = first + count};
        if (naive->has_parts && state->wave.kind == WAVE_ANY) {
            if (!gpu_buffer_reserve(tracer->device, &naive->depths, count * TRACE_DEPTH_BYTES, error))
                return false;
            tracer->stats.device_bytes = naive->depths.capacity_bytes;
            gpu_buffer_bind_storage(&naive->depths, BIND_OPTICAL_DEPTHS);
        }
        trace_parts(naive, program, scene, &some, &source);
    }
    return true;
}

const struct tracer_impl tracer_naive_impl = {
    .name = "naive",
    .depends_on = CHANGED_GEOMETRY | CHANGED_INSTANCES | CHANGED_SHADING, /* materials limit a dispatch */
    .minimum_rays = TRACE_RAYS_MULTIPLE,
    .create = naive_create,
    .destroy = naive_destroy,
    .update = naive_update,
    .trace_range = naive_trace_range,
};
