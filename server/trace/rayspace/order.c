// SPDX-License-Identifier: MIT
/* Sorts rays for the hierarchy, and decides in which direction each is traversed. */
#include "trace/rayspace/tracer.h"

#include "gpu/program.h"
#include "shared/bindings.h"

#include <epoxy/gl.h>
#include <stddef.h>

/* Shift that makes about one bin per ray. */
static uint32_t bin_shift(uint32_t rays)
{
    uint32_t shift = 0;
    while (RAYSPACE_BINS >> shift > RAYSPACE_BINS_MIN && RAYSPACE_BINS >> (shift + 1) >= rays)
        shift++;
    return shift;
}

static size_t bins_bytes(const struct rayspace_state *state)
{
    return (RAYSPACE_BINS >> bin_shift(state->base.wave.ray_count)) * sizeof(uint32_t);
}

static void bind(const struct gpu_scene *scene, struct rayspace_state *state, const struct gpu_program *program)
{
    rayspace_bind_wave(scene, state, program);
    gpu_buffer_bind_storage(&state->bins, BIND_RAYSPACE_BINS);
    gpu_buffer_bind_storage(&state->order, BIND_RAYSPACE_ORDER);
    float cells[3];
    for (int axis = 0; axis < 3; axis++) {
        const float extent = scene->upper_world[axis] - scene->lower_world[axis];
        cells[axis] = extent > 0 ? (float)(1u << RAYSPACE_POSITION_BITS) / extent : 0;
    }
    gpu_uniform_uint(program, "bin_shift", bin_shift(state->base.wave.ray_count));
    gpu_uniform_vec(program, "lower_world", 3, scene->lower_world);
    gpu_uniform_vec(program, "cells_per_metre", 3, cells);
}

static bool sample(struct rayspace_state *state, struct gpu_scene *scene, struct error *error)
{
    const struct gpu_program *program = rayspace_program_get(scene, state, "rayspace/sample.comp", NULL, error);
    if (!program)
        return false;
    bind(scene, state, program);
    gpu_uniform_uint(program, "sorts", state->sorts);
    gpu_uniform_uint(program, "turns", state->turns);
    gpu_dispatch(scene->device, program, 1);
    return true;
}

static bool sort(struct rayspace_state *state, struct gpu_scene *scene, struct error *error)
{
    static const char *const stages[] = {"SORT_COUNT", "SORT_SCAN", "SORT_PLACE"};
    const struct gpu_program *programs[3];
    for (unsigned i = 0; i < 3; i++) {
        const struct gpu_define own[] = {{stages[i], "1"}, {0}};
        programs[i] = rayspace_program_get(scene, state, "rayspace/sort.comp", own, error);
        if (!programs[i])
            return false;
    }
    const size_t groups = offsetof(struct rayspace_control, sort_groups_x);
    gpu_buffer_clear_part(scene->device, &state->bins, 0, bins_bytes(state), 0);
    for (unsigned i = 0; i < 3; i++) {
        bind(scene, state, programs[i]);
        if (i == 1)
            gpu_dispatch(scene->device, programs[i], 1); /* a single work group */
        else
            gpu_dispatch_indirect(programs[i], &state->control, groups);
    }
    return true;
}

bool rayspace_order_reserve(struct rayspace_state *state, struct gpu_device *device, struct error *error)
{
    return gpu_buffer_reserve(device, &state->order, state->base.wave.ray_count * sizeof(uint32_t), error) &&
           gpu_buffer_reserve(device, &state->bins, bins_bytes(state), error);
}

bool rayspace_order_rays(struct rayspace_state *state, struct gpu_scene *scene, struct error *error)
{
    /* Rays without a level above them need no order. */
    if (state->levels.top == 0 && state->sorts != RAYSPACE_CHANCE_ON && state->turns != RAYSPACE_CHANCE_ON)
        return true;
    if (!sample(state, scene, error))
        return false;
    if (state->sorts == RAYSPACE_CHANCE_OFF)
        return true;
    if (!rayspace_is_ahead(state)) {
        gpu_buffer_read(scene->device, &state->control, 0, &state->told, sizeof(state->told));
        if (!state->told.sorted)
            return true;
    }
    return sort(state, scene, error);
}
