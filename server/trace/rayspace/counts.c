// SPDX-License-Identifier: MIT
/* Counts the cost of a frame's waves. The device adds them up, so that no frame waits for the counts of a wave. */
#include "trace/rayspace/tracer.h"

#include "protocol/words.h"
#include "shared/bindings.h"

#define COUNTS_BYTES (WAVE_RAY_KINDS * sizeof(struct rayspace_counts))

bool rayspace_counts_add(struct rayspace_state *state, struct gpu_scene *scene, struct error *error)
{
    const struct gpu_program *program = rayspace_program_get(scene, state, "rayspace/count.comp", NULL, error);
    if (!program || !gpu_buffer_reserve(scene->device, &state->counts, COUNTS_BYTES, error))
        return false;
    if (!state->base.has_traced)
        gpu_buffer_clear_part(scene->device, &state->counts, 0, COUNTS_BYTES, 0);
    rayspace_bind_wave(scene, state, program);
    gpu_buffer_bind_storage(&state->counts, BIND_RAYSPACE_COUNTS);
    gpu_uniform_uint(program, "kind", state->base.wave.family / WAVE_BOUNCES);
    gpu_dispatch(scene->device, program, 1);
    return true;
}

bool rayspace_counts_copy(struct trace_state *state, struct error *error)
{
    struct rayspace_state *own = (struct rayspace_state *)state;
    return gpu_readback_copy(state->device, &own->copied_counts, &own->counts, 0, COUNTS_BYTES, error) &&
           gpu_readback_fence(&own->copied_counts, error);
}

static double sum_of(uint32_t low, uint32_t high)
{
    return (double)((uint64_t)high << 32 | low);
}

/* Adds the rows of a kind of rays, as a part of its own behind the trees over the scene. */
static void describe_kind(const struct rayspace_counts *counts, enum ray_kind kind, struct structure_rows *rows)
{
    const double rays = sum_of(counts->rays_low, counts->rays_high);
    rows->part = 1 + (uint32_t)kind;
    rows->part_name = protocol_ray_kind_text((enum protocol_ray_kind)kind);
    structure_per_ray(rows, "cone_tests", (float)(sum_of(counts->cone_tests_low, counts->cone_tests_high) / rays));
    structure_per_ray(rows, "triangle_tests",
                      (float)(sum_of(counts->triangle_tests_low, counts->triangle_tests_high) / rays));
    structure_number(rows, "waves", counts->waves);
    structure_number(rows, "sorted", counts->sorted);
    structure_number(rows, "turned", counts->turned);
    structure_number(rows, "pairs_max", counts->pairs_max);
    structure_number(rows, "passes", counts->passes);
    structure_number(rows, "halvings", counts->halvings);
}

bool rayspace_counts_report(struct trace_state *state, struct structure_rows *rows, struct error *error)
{
    struct rayspace_counts counts[WAVE_RAY_KINDS];
    if (!gpu_readback_take(state->device, &((struct rayspace_state *)state)->copied_counts, counts, error))
        return false;
    for (unsigned kind = 0; kind < RAY_COUNT; kind++)
        if (counts[kind].waves > 0)
            describe_kind(&counts[kind], (enum ray_kind)kind, rows);
    return true;
}
