/* SPDX-License-Identifier: MIT */
/* State of waves through the quadtrees, their passes, and the counts of their rays. */
#include "trace/quadtree/trace.h"

#include "protocol/words.h"
#include "shared/hit.h"
#include "trace/program.h"

#include <stdlib.h>

#define SOURCE_DEFINES 3

/* Contents of the buffer of counts. */
struct counts {
    struct quadtree_counts kinds[QUADTREE_KINDS];
    uint32_t outcomes[QUADTREE_OUTCOMES];
};

_Static_assert(QUADTREE_KINDS == WAVE_RAY_KINDS, "counts for each kind of rays");

/* ---- state ---- */

struct trace_state *quadtree_state_create(struct gpu_device *device, const struct tracer_options *options,
                                          struct error *error)
{
    (void)device, (void)options;
    struct quadtree_state *state = calloc(1, sizeof(*state));
    if (!state)
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the state of a wave");
    return state ? &state->base : NULL;
}

void quadtree_state_destroy(struct trace_state *state)
{
    struct quadtree_state *own = (struct quadtree_state *)state;
    gpu_buffer_finish(state->device, &own->counts);
    gpu_readback_finish(state->device, &own->copied_counts);
    gpu_buffer_finish(state->device, &own->beams);
    free(own);
}

uint64_t quadtree_state_device_bytes(const struct trace_state *state)
{
    const struct quadtree_state *own = (const struct quadtree_state *)state;
    return own->counts.capacity_bytes + own->copied_counts.capacity_bytes + own->beams.capacity_bytes;
}

bool quadtree_state_copy_counts(struct trace_state *state, struct error *error)
{
    struct quadtree_state *own = (struct quadtree_state *)state;
    return gpu_readback_copy(state->device, &own->copied_counts, &own->counts, 0, sizeof(struct counts), error) &&
           gpu_readback_fence(&own->copied_counts, error);
}

static void describe_kind(const struct quadtree_counts *counts, enum ray_kind kind, uint32_t layers,
                          struct structure_rows *rows)
{
    const float rays = (float)counts->rays;
    rows->part = 1 + (uint32_t)kind;
    rows->part_name = protocol_ray_kind_text((enum protocol_ray_kind)kind);
    if (layers > 1)
        structure_per_ray(rows, "behind_layer_1", (float)counts->behind_first / rays);
    if (layers > 2)
        structure_per_ray(rows, "behind_layer_2", (float)counts->behind_second / rays);
    structure_per_ray(rows, "unknown_behind", (float)counts->behind_last / rays);
    structure_per_ray(rows, "unknown_outside", (float)counts->outside / rays);
}

/* Adds the rays of eyes to the counts of their kind. */
static void add_eyes(struct counts *counts, uint64_t samples)
{
    struct quadtree_counts *sums = &counts->kinds[RAY_PRIMARY];
    sums->rays += (uint32_t)samples - counts->outcomes[QUADTREE_DEAD];
    for (unsigned number = 0; number < QUADTREE_OUTCOMES; number++) {
        const uint32_t count = number != QUADTREE_DEAD ? counts->outcomes[number] : 0, behind = number % 4;
        sums->behind_first += behind > 0 ? count : 0;
        sums->behind_second += behind > 1 ? count : 0;
        sums->behind_last += number & QUADTREE_BEHIND ? count : 0;
        sums->outside += number & QUADTREE_OUTSIDE ? count : 0;
    }
}

bool quadtree_state_report(struct trace_state *state, struct structure_rows *rows, struct error *error)
{
    struct quadtree_state *own = (struct quadtree_state *)state;
    struct counts counts;
    if (!gpu_readback_take(state->device, &own->copied_counts, &counts, error))
        return false;
    add_eyes(&counts, own->eye_samples);
    for (unsigned kind = 0; kind < RAY_COUNT; kind++)
        if (counts.kinds[kind].rays > 0)
            describe_kind(&counts.kinds[kind], (enum ray_kind)kind, quadtree_layer_count(&state->options.quadtree),
                          rows);
    return true;
}

/* ---- waves ---- */

bool quadtree_trace_begin(struct trace_state *state, struct error *error)
{
    struct quadtree_state *own = (struct quadtree_state *)state;
    if (!gpu_buffer_reserve(state->device, &own->counts, sizeof(struct counts), error))
        return false;
    if (state->has_traced)
        return true;
    own->eye_samples = 0; /* the first wave of the frame */
    gpu_buffer_clear_part(state->device, &own->counts, 0, sizeof(struct counts), 0);
    return true;
}

static struct trace_program_source source_of(const struct tracer_options *options,
                                             struct gpu_define defines[SOURCE_DEFINES])
{
    size_t n = 0;
    if (quadtree_hits_planes(&options->quadtree))
        defines[n++] = (struct gpu_define){"QUADTREE_PLANES", "1"};
    if (options->quadtree.faces == QUADTREE_FACES_VIEW)
        defines[n++] = (struct gpu_define){"QUADTREE_VIEW", "1"};
    else /* NVIDIA's compiler (driver 580) did not finish within minutes on nested loops over faces, layers and
            nodes */
        defines[n++] = (struct gpu_define){"PRAGMA", "optionNV(unroll none)"};
    return (struct trace_program_source){.traverse = "quadtree/traverse.glsl", .defines = defines};
}

uint64_t quadtree_rounds_of_a_ray(const struct quadtree_store *store)
{
    const struct quadtree_uniforms *u = &store->uniforms;
    return (uint64_t)u->faces * u->layers * (u->padded_width + u->padded_height) * 2;
}

bool quadtree_intersect(struct quadtree_store *store, struct gpu_scene *scene, struct quadtree_state *state,
                        const struct ray_range *rays, const struct tracer_options *options, struct error *error)
{
    struct gpu_define defines[SOURCE_DEFINES] = {0};
    struct trace_program_source source = source_of(options, defines);
    const struct gpu_program *program = trace_program_get(scene, rays->wave, &source, error);
    if (!program)
        return false;
    source.rays_a_dispatch = trace_rays_a_dispatch(store->device, quadtree_rounds_of_a_ray(store));
    quadtree_store_bind(store);
    gpu_buffer_bind_storage(&state->counts, BIND_QUADTREE_COUNTS);
    gpu_uniform_uint(program, "ray_kind", rays->wave->family / WAVE_BOUNCES);
    trace_program_run(program, scene, rays, &source);
    return true;
}

bool quadtree_layer_hits(struct quadtree_store *store, struct gpu_scene *scene, const struct ray_range *rays,
                         uint32_t layer, struct error *error)
{
    const struct gpu_define defines[] = {{scene->has_spheres ? "HAS_SPHERES" : NULL, "1"}, {NULL, NULL}};
    const struct gpu_program *program =
        trace_surface_program_get(scene, rays->wave, "quadtree/layer_hits.comp", defines, error);
    if (!program)
        return false;
    quadtree_store_bind(store);
    gpu_uniform_uint(program, "layer", layer);
    gpu_uniform_uint(program, "only_within_reach", rays->wave->within_reach && layer > 0);
    trace_surface_program_run(program, scene, rays);
    return true;
}

void quadtree_announce(struct gpu_scene *scene, const struct wave *wave, const struct tracer_options *options)
{
    struct gpu_define defines[SOURCE_DEFINES] = {0};
    const struct trace_program_source source = source_of(options, defines);
    (void)trace_program_get(scene, wave, &source, NULL);
}
