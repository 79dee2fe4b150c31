// SPDX-License-Identifier: MIT
/* Pairs of nodes and elements descend both hierarchies together (section 3.3, and the outlook of section 6). */
#include "trace/rayspace/tracer.h"

#include "gpu/program.h"
#include "shared/bindings.h"
#include "shared/wave.h"
#include "trace/program.h"

#include <epoxy/gl.h>
#include <stddef.h>
#include <stdio.h>

/* Pairs of a stack: so many a ray, within bounds. */
#define PAIRS_A_RAY 8u
#define PAIRS_MIN (1u << 16)
#define PAIRS_MAX (1u << 22)
/* See shaders/rayspace/control.comp: a pass of one pair leaves four more behind, at each of some hundred levels.
 */
#define PAIRS_RESERVED (1u << 12)
/* Leaves that are worth a dispatch, as a share of those that there is room for. */
#define LEAVES_WANTED(capacity) ((capacity) / 2)
/* Passes that are queued where the host does not wait: there are some forty levels in both hierarchies, and the
 * two stacks take turns. */
#define PASSES_AHEAD 96u

static const struct gpu_program *program_of(const struct gpu_scene *scene, const struct rayspace_state *state,
                                            const char *compute, const struct gpu_define *own, struct error *error)
{
    struct gpu_define defines[TRACE_WAVE_DEFINES + 6] = {0};
    size_t n = trace_wave_defines(scene, &state->base.wave, defines);
    for (; own && own->name; own++)
        defines[n++] = *own;
    return gpu_program_get(scene->device, &(struct gpu_program_source){.compute = compute, .defines = defines},
                           error);
}

bool rayspace_descent_begin(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                            struct error *error)
{
    struct gpu_device *device = scene->device;
    const struct wave *wave = &state->base.wave;
    const uint32_t rays = wave->ray_count;
    state->levels = rayspace_levels_over(rays);
    state->capacity = rays < PAIRS_MIN / PAIRS_A_RAY   ? PAIRS_MIN
                      : rays < PAIRS_MAX / PAIRS_A_RAY ? PAIRS_A_RAY * rays
                                                       : PAIRS_MAX;
    state->leaves_capacity = state->capacity;
    const size_t pair_bytes = (size_t)state->capacity * RAYSPACE_PAIR_BYTES;
    if (!gpu_buffer_reserve(device, &state->answers, (size_t)rays * RAYSPACE_ANSWER_BYTES, error) ||
        !gpu_buffer_reserve(device, &state->stacks[0], pair_bytes, error) ||
        !gpu_buffer_reserve(device, &state->stacks[1], pair_bytes, error) ||
        !gpu_buffer_reserve(device, &state->leaves, (size_t)state->leaves_capacity * RAYSPACE_PAIR_BYTES, error) ||
        !gpu_buffer_reserve(device, &state->control, sizeof(struct rayspace_control), error))
        return false;
    const uint32_t no_light_lost[4] = {0},
                   no_hit[4] = {UINT32_MAX, RAYSPACE_NO_RANK, UINT32_MAX, RAYSPACE_NO_RANK};
    gpu_buffer_fill(device, &state->answers, 0, (size_t)rays * RAYSPACE_ANSWER_BYTES,
                    wave->kind == WAVE_ANY ? no_light_lost : no_hit);
    /* One pair: all rays, and all of the scene. */
    const uint32_t root[4] = {state->levels.top << RAYSPACE_LEVEL_SHIFT, 0, RAYSPACE_TOP, 0};
    const struct rayspace_control control = {
        .waiting_0 = rayspace->tree.top.element_count > 0,
        .limit = rayspace->base.options.rayspace.batch ? rayspace->base.options.rayspace.batch : state->capacity,
    };
    gpu_buffer_write(device, &state->stacks[0], 0, root, sizeof(root));
    gpu_buffer_write(device, &state->control, 0, &control, sizeof(control));
    state->from = 0;
    return rayspace_nodes_build(state, scene, false, error);
}

static bool dispatch_control(const struct gpu_scene *scene, const struct rayspace *rayspace,
                             struct rayspace_state *state, struct error *error)
{
    const struct gpu_program *program =
        gpu_program_get(scene->device, &(struct gpu_program_source){.compute = "rayspace/control.comp"}, error);
    const uint32_t batch = rayspace->base.options.rayspace.batch;
    if (!program)
        return false;
    gpu_buffer_bind_storage(&state->control, BIND_RAYSPACE_CONTROL);
    gpu_uniform_uint(program, "from", state->from);
    gpu_uniform_uint(program, "capacity", state->capacity);
    gpu_uniform_uint(program, "leaves_capacity", state->leaves_capacity);
    gpu_uniform_uint(program, "leaves_wanted", LEAVES_WANTED(state->leaves_capacity));
    gpu_uniform_uint(program, "limit_max", batch ? batch : state->capacity);
    gpu_uniform_uint(program, "reserve", PAIRS_RESERVED);
    gpu_dispatch(scene->device, program, 1);
    return true;
}

static void bind_wave(struct gpu_scene *scene, struct rayspace *rayspace, struct rayspace_state *state,
                      const struct gpu_program *program)
{
    const struct wave *wave = &state->base.wave;
    trace_bind_rays(scene, wave);
    scene_tree_bind(&rayspace->tree);
    gpu_buffer_bind_texels(scene->device, &rayspace->ranks, UNIT_RAYSPACE_RANKS, GL_R32UI);
    gpu_buffer_bind_storage(&state->control, BIND_RAYSPACE_CONTROL);
    gpu_buffer_bind_storage(&state->leaves, BIND_RAYSPACE_LEAVES);
    gpu_buffer_bind_storage(&state->answers, BIND_RAYSPACE_ANSWERS);
    if (wave->counts)
        gpu_buffer_bind_storage(wave->counts, BIND_WAVE);
    gpu_uniform_uint(program, "counts_index", wave->counts_index);
    gpu_uniform_uint(program, "ray_count", wave->ray_count);
}

static bool dispatch_leaves(struct gpu_scene *scene, struct rayspace *rayspace, struct rayspace_state *state,
                            struct error *error)
{
    static const char *const stages[] = {"LEAVES_TEST", "LEAVES_RANK", "LEAVES_SETTLE"};
    const unsigned count = state->base.wave.kind == WAVE_ANY ? 1 : 3;
    for (unsigned i = 0; i < count; i++) {
        const struct gpu_define own[] = {{stages[i], "1"}, {0}};
        const struct gpu_program *program = program_of(scene, state, "rayspace/leaves.comp", own, error);
        if (!program)
            return false;
        bind_wave(scene, rayspace, state, program);
        gpu_dispatch_indirect(program, &state->control, offsetof(struct rayspace_control, leaf_groups_x));
    }
    return true;
}

static bool dispatch_pass(struct gpu_scene *scene, struct rayspace *rayspace, struct rayspace_state *state,
                          struct error *error)
{
    const struct scene_tree *tree = &rayspace->tree;
    const bool packed = bvh_is_packed(&tree->store.settings);
    const struct gpu_define own[] = {{packed ? "RAYSPACE_PACKED" : NULL, "1"}, {0}};
    const struct gpu_program *program = program_of(scene, state, "rayspace/descend.comp", own, error);
    if (!program)
        return false;
    bind_wave(scene, rayspace, state, program);
    gpu_buffer_bind_texels(scene->device, &state->nodes, UNIT_RAYSPACE_NODES, GL_RGBA32F);
    gpu_buffer_bind_texels(scene->device, &state->stacks[state->from], UNIT_RAYSPACE_PAIRS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&state->stacks[1 - state->from], BIND_RAYSPACE_PAIRS);
    gpu_uniform_uint(program, "top_count", tree->top.element_count);
    if (packed) {
        float cell[3];
        for (int axis = 0; axis < 3; axis++)
            cell[axis] = 1 / tree->top.grid.cells_per_unit[axis];
        gpu_uniform_vec(program, "top_grid_lower", 3, tree->top.grid.lower);
        gpu_uniform_vec(program, "top_cell", 3, cell);
    }
    for (uint32_t level = 0; level <= state->levels.top; level++) {
        char name[24];
        snprintf(name, sizeof(name), "level_first[%u]", level);
        gpu_uniform_uint(program, name, state->levels.first[level]);
        snprintf(name, sizeof(name), "level_count[%u]", level);
        gpu_uniform_uint(program, name, state->levels.count[level]);
    }
    gpu_dispatch_indirect(program, &state->control, offsetof(struct rayspace_control, pass_groups_x));
    return true;
}

/* Until about that time. The host waits for each pass, and leaves out what there is none of. */
static enum tracer_progress descend_waiting(struct rayspace *rayspace, struct gpu_scene *scene,
                                            struct rayspace_state *state, uint64_t step_end_ns,
                                            struct error *error)
{
    for (;;) {
        struct rayspace_control *control = &state->told;
        if (!dispatch_control(scene, rayspace, state, error))
            return TRACER_FAILED;
        gpu_buffer_read(scene->device, &state->control, 0, control, sizeof(*control));
        if (scene->device->lost)
            return tracer_progress_of(gpu_check(scene->device, "tracing", error));
        if (control->leaves_taken > 0 && !dispatch_leaves(scene, rayspace, state, error))
            return TRACER_FAILED;
        if (control->taken > 0 && !dispatch_pass(scene, rayspace, state, error))
            return TRACER_FAILED;
        state->from = 1 - state->from;
        if (control->waiting_0 + control->waiting_1 + control->leaves == 0)
            return TRACER_DONE;
        if (step_is_over(step_end_ns))
            return TRACER_MORE;
    }
}

enum tracer_progress rayspace_descent_step(struct rayspace *rayspace, struct gpu_scene *scene,
                                           struct rayspace_state *state, uint64_t step_end_ns, struct error *error)
{
    return descend_waiting(rayspace, scene, state, step_end_ns, error);
}

bool rayspace_descent_finish(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                             struct error *error)
{
    const struct wave *wave = &state->base.wave;
    const struct gpu_define own[] = {{"TRACER_RAYSPACE", "1"}, {0}};
    const struct trace_program_source source = {.traverse = "rayspace/traverse.glsl", .defines = own};
    const struct ray_range all = {.wave = wave, .end = wave->ray_count};
    const struct gpu_program *program = trace_program_get(scene, wave, &source, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(scene->device, &rayspace->ranks, UNIT_RAYSPACE_RANKS, GL_R32UI);
    gpu_buffer_bind_storage(&state->answers, BIND_RAYSPACE_ANSWERS);
    trace_program_run(program, scene, &all, &source);
    return true;
}
