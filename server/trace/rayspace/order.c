// SPDX-License-Identifier: MIT
/* Which rays stand beside one another in the hierarchy, and which way round they are taken. */
#include "trace/rayspace/tracer.h"

#include "gpu/program.h"
#include "shared/bindings.h"
#include "trace/program.h"

#include <epoxy/gl.h>
#include <stddef.h>

static const struct gpu_program *get(const struct gpu_scene *scene, const struct wave *wave, const char *compute,
                                     const char *stage, struct error *error)
{
    struct gpu_define defines[TRACE_WAVE_DEFINES + 2] = {0};
    const size_t n = trace_wave_defines(scene, wave, defines);
    if (stage)
        defines[n] = (struct gpu_define){stage, "1"};
    return gpu_program_get(scene->device, &(struct gpu_program_source){.compute = compute, .defines = defines},
                           error);
}

/* About one for each ray. */
static uint32_t bin_shift(uint32_t rays)
{
    uint32_t shift = 0;
    while (RAYSPACE_BINS >> shift > RAYSPACE_BINS_MIN && RAYSPACE_BINS >> (shift + 1) >= rays)
        shift++;
    return shift;
}

static void bind(const struct gpu_scene *scene, struct rayspace_state *state, const struct gpu_program *program)
{
    const struct wave *wave = &state->base.wave;
    trace_bind_rays(scene, wave);
    gpu_buffer_bind_storage(&state->control, BIND_RAYSPACE_CONTROL);
    gpu_buffer_bind_storage(&state->bins, BIND_RAYSPACE_BINS);
    gpu_buffer_bind_storage(&state->order, BIND_RAYSPACE_ORDER);
    if (wave->counts)
        gpu_buffer_bind_storage(wave->counts, BIND_WAVE);
    gpu_uniform_uint(program, "counts_index", wave->counts_index);
    gpu_uniform_uint(program, "ray_count", wave->ray_count);
    float cells[3];
    for (int axis = 0; axis < 3; axis++) {
        const float extent = scene->upper_world[axis] - scene->lower_world[axis];
        cells[axis] = extent > 0 ? (float)(1u << RAYSPACE_POSITION_BITS) / extent : 0;
    }
    gpu_uniform_uint(program, "bin_shift", bin_shift(wave->ray_count));
    gpu_uniform_vec(program, "lower_world", 3, scene->lower_world);
    gpu_uniform_vec(program, "cells_per_metre", 3, cells);
}

/* The numbers that shaders/rayspace/sample.comp has for it. */
static uint32_t chance_of(enum rayspace_chance chance)
{
    return chance == RAYSPACE_CHANCE_AUTO ? 2 : chance == RAYSPACE_CHANCE_ON;
}

static bool sample(struct rayspace_state *state, struct gpu_scene *scene, struct error *error)
{
    const struct rayspace_settings *settings = &state->base.options.rayspace;
    const struct gpu_program *program = get(scene, &state->base.wave, "rayspace/sample.comp", NULL, error);
    if (!program)
        return false;
    bind(scene, state, program);
    gpu_buffer_bind_storage(&state->answers, BIND_RAYSPACE_ANSWERS);
    gpu_uniform_uint(program, "sorts", chance_of(settings->sort));
    gpu_uniform_uint(program, "turns", chance_of(settings->turn));
    gpu_dispatch(scene->device, program, 1);
    return true;
}

static bool sort(struct rayspace_state *state, struct gpu_scene *scene, struct error *error)
{
    const struct wave *wave = &state->base.wave;
    const struct gpu_program *count = get(scene, wave, "rayspace/sort.comp", "SORT_COUNT", error);
    const struct gpu_program *scan = count ? get(scene, wave, "rayspace/sort.comp", "SORT_SCAN", error) : NULL;
    const struct gpu_program *place = scan ? get(scene, wave, "rayspace/sort.comp", "SORT_PLACE", error) : NULL;
    if (!place)
        return false;
    const size_t groups = offsetof(struct rayspace_control, sort_groups_x);
    gpu_buffer_clear_part(scene->device, &state->bins, 0,
                          (RAYSPACE_BINS >> bin_shift(wave->ray_count)) * sizeof(uint32_t), 0);
    bind(scene, state, count);
    gpu_dispatch_indirect(count, &state->control, groups);
    bind(scene, state, scan);
    gpu_dispatch(scene->device, scan, 1);
    bind(scene, state, place);
    gpu_dispatch_indirect(place, &state->control, groups);
    return true;
}

bool rayspace_order_rays(struct rayspace_state *state, struct gpu_scene *scene, struct error *error)
{
    struct gpu_device *device = scene->device;
    const uint32_t rays = state->base.wave.ray_count;
    if (!gpu_buffer_reserve(device, &state->order, rays * sizeof(uint32_t), error) ||
        !gpu_buffer_reserve(device, &state->bins, RAYSPACE_BINS * sizeof(uint32_t), error) ||
        !sample(state, scene, error))
        return false;
    if (state->base.options.rayspace.sort == RAYSPACE_CHANCE_OFF)
        return true;
    if (!rayspace_is_ahead(state)) {
        gpu_buffer_read(device, &state->control, 0, &state->told, sizeof(state->told));
        if (!state->told.sorted)
            return true;
    }
    return sort(state, scene, error);
}
