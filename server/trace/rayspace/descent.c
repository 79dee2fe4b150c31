// SPDX-License-Identifier: MIT
/* Descent of pairs of a node over rays and a part of the scene: the nodes alone descend (section 3.3), or both
 * hierarchies together (the outlook of section 6). */
#include "trace/rayspace/tracer.h"

#include "gpu/program.h"
#include "shared/bindings.h"
#include "shared/wave.h"
#include "trace/program.h"

#include <epoxy/gl.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

/* Pairs in a stack: this many per ray, within bounds. */
#define PAIRS_A_RAY 8u
#define PAIRS_MIN (1u << 16)
#define PAIRS_MAX (1u << 22)
#define PAIRS_LEAST (1u << 12) /* minimum where memory is short */
/* Reserve for passes of one pair, which leave four more behind at each of some hundred levels
 * (shaders/rayspace/control.comp). */
#define PAIRS_RESERVED (1u << 12)
/* Maximum of nodes that a descent begins with; a small wave begins with its rays. A pass of few pairs takes as
 * long as one of hundreds, and so does a level of few nodes. */
#define SEEDS_MAX 256u
/* Minimum of rays that a dispatch tests with all discs. */
#define RANGE_RAYS_MIN TRACE_RAYS_MULTIPLE
#define ITEMS_MAX (1u << 20) /* per batch */
/* Passes queued where the host does not wait: for the joint descent, whose two hierarchies have some forty
 * levels together; for a batch of the flat one, beyond the levels of the rays; and the number of passes whose
 * leaves are tested together. */
#define PASSES_JOINT 64u
#define PASSES_FLAT 16u
#define PASSES_A_TEST 8u
/* Maximum of failed passes in a row: halving from all pairs of a stack to one takes fewer. */
#define FAILED_IN_TURN_MAX 64u
/* A node is divided while it is wider than this fraction of the element: the factor that gave the fewest tests. */
#define SPLIT_FACTOR 4.0f
#define LEAVES_ALL 0u
#define LEAVES_NONE UINT32_MAX

bool rayspace_is_ahead(const struct rayspace_state *state)
{
    return state->base.wave.stopped && !state->base.patient;
}

static bool is_paper(const struct tracer_options *options)
{
    return options->rayspace.form == TRACER_FORM_PAPER;
}

bool rayspace_is_flat(const struct tracer_options *options)
{
    return is_paper(options) || options->rayspace.mode == RAYSPACE_MODE_FLAT;
}

static bool is_flat(const struct rayspace_state *state)
{
    return rayspace_is_flat(&state->base.options);
}

/* Whether separate passes reduce the stream. */
static bool leaves_slots(const struct rayspace_state *state)
{
    return is_paper(&state->base.options);
}

static struct gpu_buffer *stack_taken_from(struct rayspace_state *state)
{
    return &state->stacks[state->turn];
}

static struct gpu_buffer *stack_written_to(struct rayspace_state *state)
{
    return &state->stacks[!state->turn];
}

const struct gpu_program *rayspace_program_get(const struct gpu_scene *scene, const struct rayspace_state *state,
                                               const char *compute, const struct gpu_define *own,
                                               struct error *error)
{
    struct gpu_define defines[RAYSPACE_DEFINES + 3] = {0};
    size_t n = 0;
    if (state->base.wave.kind == WAVE_ANY)
        defines[n++] = (struct gpu_define){"ANY_HIT", "1"};
    if (state->base.wave.counts)
        defines[n++] = (struct gpu_define){"HAS_COUNTS", "1"};
    for (size_t i = 0; i < RAYSPACE_DEFINES && own && own[i].name; i++)
        defines[n++] = own[i];
    return gpu_program_get(scene->device, &(struct gpu_program_source){.compute = compute, .defines = defines},
                           error);
}

void rayspace_bind_wave(const struct gpu_scene *scene, struct rayspace_state *state,
                        const struct gpu_program *program)
{
    const struct wave *wave = &state->base.wave;
    trace_bind_rays(scene, wave);
    gpu_buffer_bind_texels(scene->device, &state->order, UNIT_RAYSPACE_ORDER, GL_R32UI);
    gpu_buffer_bind_storage(&state->control, BIND_RAYSPACE_CONTROL);
    gpu_buffer_bind_storage(&state->answers, BIND_RAYSPACE_ANSWERS);
    if (wave->counts)
        gpu_buffer_bind_storage(wave->counts, BIND_WAVE);
    gpu_uniform_uint(program, "counts_index", wave->counts_index);
    gpu_uniform_uint(program, "ray_count", wave->ray_count);
}

/* Binds the times of rays for tests against primitives. */
static void bind_times(const struct gpu_scene *scene, const struct wave *wave)
{
    if (trace_has_motion(scene, wave))
        gpu_buffer_bind_storage(wave->times, BIND_RAYSPACE_TIMES);
}

/* ---- preparation ---- */

static uint32_t at_most(uint32_t number, uint32_t maximum)
{
    return number < maximum ? number : maximum;
}

/* Pairs to reserve for each stack, if memory allows. */
static uint32_t capacity_of(const struct rayspace_state *state)
{
    const uint32_t rays = state->base.wave.ray_count;
    const uint32_t wanted =
        rays < PAIRS_MIN / PAIRS_A_RAY ? PAIRS_MIN : at_most(rays, PAIRS_MAX / PAIRS_A_RAY) * PAIRS_A_RAY;
    return at_most(wanted, state->capacity_fits ? state->capacity_fits : UINT32_MAX);
}

/* Pairs of the capacity that are kept for passes of one pair. */
static uint32_t reserved_of(const struct rayspace_state *state)
{
    return at_most(PAIRS_RESERVED, state->capacity / 4);
}

/* Pairs of a pass, or items of a batch, after the halvings that the last waves of the family needed. */
static uint32_t batch_of(const struct rayspace_state *state, uint32_t maximum)
{
    const uint32_t batch = maximum >> state->halved[state->base.wave.family];
    return batch > 0 ? batch : 1;
}

static uint32_t pass_max(const struct rayspace_state *state, const struct gpu_device *device)
{
    const uint32_t pairs = batch_of(state, state->capacity);
    return leaves_slots(state) ? rayspace_reduction_pairs(device, pairs) : pairs;
}

/* Reserves the buffers, those per ray first, whose size is fixed. */
static bool try_to_reserve(struct rayspace_state *state, struct gpu_device *device, struct error *error)
{
    const uint32_t rays = state->base.wave.ray_count;
    const size_t pair_bytes = (size_t)state->capacity * RAYSPACE_PAIR_BYTES;
    bool good = gpu_buffer_reserve(device, &state->answers, (size_t)rays * RAYSPACE_ANSWER_BYTES, error) &&
                gpu_buffer_reserve(device, &state->control, sizeof(struct rayspace_control), error) &&
                rayspace_nodes_reserve(state, device, error) && rayspace_order_reserve(state, device, error);
    for (unsigned i = 0; i < RAYSPACE_STACKS && good; i++)
        good = gpu_buffer_reserve(device, &state->stacks[i], pair_bytes, error);
    if (is_flat(state))
        good = good && gpu_buffer_reserve(device, &state->items,
                                          (size_t)state->batch_max * RAYSPACE_ITEM_TEXELS * sizeof(vec4), error);
    if (leaves_slots(state))
        good = good && rayspace_reduction_reserve(device, &state->reduction, pass_max(state, device), error);
    return good && gpu_buffer_reserve(device, &state->leaves, pair_bytes, error);
}

static void release_stacks(struct rayspace_state *state, struct gpu_device *device)
{
    for (unsigned i = 0; i < RAYSPACE_STACKS; i++)
        gpu_buffer_finish(device, &state->stacks[i]);
    gpu_buffer_finish(device, &state->leaves);
    gpu_buffer_finish(device, &state->items);
    rayspace_reduction_finish(device, &state->reduction);
}

/* Reserves; halves stacks that do not fit into memory, for good: passes then process fewer pairs. */
static bool reserve(const struct rayspace *rayspace, struct rayspace_state *state, struct gpu_device *device,
                    struct error *error)
{
    for (;;) {
        struct error own = {0};
        state->capacity = capacity_of(state);
        /* Each batch goes onto one stack in a single pass, whole. */
        const uint32_t room = state->capacity - reserved_of(state);
        state->batch_max = at_most(batch_of(state, at_most(room, ITEMS_MAX)), rayspace->rank_count);
        if (try_to_reserve(state, device, &own))
            return true;
        if (own.kind != ERROR_OUT_OF_MEMORY || state->capacity <= PAIRS_LEAST) {
            *error = own;
            return false;
        }
        release_stacks(state, device);
        state->capacity_fits = state->capacity / 2;
    }
}

/* The end of the range of rays from `first` on that a dispatch tests with all discs. */
static uint32_t end_of_range(const struct gpu_scene *scene, const struct rayspace_state *state, uint32_t first)
{
    const uint32_t left = state->base.wave.ray_count - first;
    const uint64_t fitting = scene->device->facts.list_tests_max / (scene->disc_count + (uint64_t)1);
    const uint64_t count = fitting > RANGE_RAYS_MIN ? fitting : RANGE_RAYS_MIN;
    return first + (count < left ? (uint32_t)count : left);
}

/* Tests some rays with all discs. A ray ends at the first one that it hits. */
static bool test_discs(struct gpu_scene *scene, struct rayspace_state *state, struct error *error)
{
    const uint32_t first = state->disc_rays, end = end_of_range(scene, state, first);
    struct gpu_define defines[TRACE_WAVE_DEFINES + 1] = {0};
    trace_wave_defines(scene, &state->base.wave, defines);
    const struct gpu_program_source source = {.compute = "rayspace/discs.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(scene->device, &source, error);
    if (!program)
        return false;
    rayspace_bind_wave(scene, state, program);
    bind_times(scene, &state->base.wave);
    gpu_uniform_uint(program, "disc_count", scene->disc_count);
    gpu_uniform_uint(program, "first_ray", first);
    gpu_uniform_uint(program, "ray_count", end);
    gpu_dispatch(scene->device, program, end - first);
    state->disc_rays = end;
    return true;
}

/* Pushes the nodes that together hold all rays, each with the whole scene. Levels above them are not made.
 * Where waves are queued ahead, the number of rays is unknown on the host, and the seed is the root. */
static void put_seeds(struct rayspace_state *state, struct gpu_device *device, bool has_scene)
{
    struct rayspace_levels *levels = &state->levels;
    const uint32_t fitting = at_most(at_most(SEEDS_MAX, pass_max(state, device)), state->capacity / PAIRS_A_RAY);
    const uint32_t most = rayspace_is_ahead(state) ? 1 : fitting;
    uint32_t seeds[SEEDS_MAX][4];
    while (levels->top > 0 && levels->count[levels->top - 1] <= most)
        levels->top--;
    if (!has_scene)
        return;
    state->seeds = levels->count[levels->top];
    for (uint32_t i = 0; i < state->seeds; i++) {
        const uint32_t seed[4] = {levels->top << RAYSPACE_LEVEL_SHIFT | i, 0, RAYSPACE_TOP, 0};
        memcpy(seeds[i], seed, sizeof(seed));
    }
    gpu_buffer_write(device, &state->stacks[0], 0, seeds, state->seeds * sizeof(seeds[0]));
}

bool rayspace_descent_begin(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                            struct error *error)
{
    struct gpu_device *device = scene->device;
    const struct wave *wave = &state->base.wave;
    state->levels = rayspace_levels_over(wave->ray_count);
    if (!reserve(rayspace, state, device, error))
        return false;
    const uint32_t no_light_lost[4] = {0},
                   no_hit[4] = {UINT32_MAX, RAYSPACE_NO_RANK, UINT32_MAX, RAYSPACE_NO_RANK};
    gpu_buffer_fill(device, &state->answers, 0, (size_t)wave->ray_count * RAYSPACE_ANSWER_BYTES,
                    wave->kind == WAVE_ANY ? no_light_lost : no_hit);
    const struct rayspace_control control = {.limit = pass_max(state, device)};
    gpu_buffer_write(device, &state->control, 0, &control, sizeof(control));
    state->disc_rays = scene->disc_count > 0 ? 0 : wave->ray_count;
    state->finished_rays = 0;
    state->has_nodes = state->has_descended = false;
    return true;
}

/* Makes the nodes of the rays, which end at discs by now. */
static bool make_nodes(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                       struct error *error)
{
    state->next_rank = state->seeds = 0;
    state->turn = false;
    state->has_nodes = true;
    if (!is_flat(state))
        put_seeds(state, scene->device, rayspace->tree.top.element_count > 0);
    return rayspace_order_rays(state, scene, error) && rayspace_nodes_build(state, scene, error);
}

/* ---- passes ---- */

/* Children that must fit on the stack. Near the root the pairs of a flat batch have nearly as many children as
 * possible: a pass over all of them would fail and be repeated with half of them. Where waves are queued ahead,
 * there are few passes and each takes what it can: batches that do not fit are halved for the next wave. In the
 * joint descent hardly any pass fails. */
static uint32_t children_with_room(const struct rayspace_state *state)
{
    return is_flat(state) && !rayspace_is_ahead(state) ? RAYSPACE_CHILDREN : 0;
}

static bool dispatch_control(struct rayspace_state *state, const struct gpu_scene *scene, uint32_t leaves_wanted,
                             uint32_t end, struct error *error)
{
    const struct wave *wave = &state->base.wave;
    const struct gpu_program *program =
        gpu_program_get(scene->device, &(struct gpu_program_source){.compute = "rayspace/control.comp"}, error);
    if (!program)
        return false;
    gpu_buffer_bind_storage(&state->control, BIND_RAYSPACE_CONTROL);
    if (wave->stopped)
        gpu_buffer_bind_storage(wave->stopped, BIND_RAYSPACE_STOPPED);
    gpu_uniform_uint(program, "last_from", state->last_turn);
    gpu_uniform_uint(program, "last_to", !state->last_turn);
    gpu_uniform_uint(program, "from", state->turn);
    gpu_uniform_uint(program, "to", !state->turn);
    gpu_uniform_uint(program, "capacity", state->capacity);
    gpu_uniform_uint(program, "leaves_wanted", leaves_wanted);
    gpu_uniform_uint(program, "limit_max", pass_max(state, scene->device));
    gpu_uniform_uint(program, "reserve", reserved_of(state));
    gpu_uniform_uint(program, "children", children_with_room(state));
    gpu_uniform_uint(program, "seeds", state->seeds);
    gpu_uniform_uint(program, "ends", end);
    gpu_uniform_uint(program, "stopped_word", rayspace_is_ahead(state) ? wave->stopped_word : UINT32_MAX);
    gpu_dispatch(scene->device, program, 1);
    state->seeds = 0;
    return true;
}

/* Binds the inputs of passes and of leaf tests. */
static void bind_descent(struct gpu_scene *scene, struct rayspace *rayspace, struct rayspace_state *state,
                         const struct gpu_program *program)
{
    struct gpu_device *device = scene->device;
    rayspace_bind_wave(scene, state, program);
    scene_tree_bind(&rayspace->tree);
    gpu_buffer_bind_texels(device, &rayspace->ranks, UNIT_RAYSPACE_RANKS, GL_R32UI);
    gpu_buffer_bind_texels(device, &state->items, UNIT_RAYSPACE_ITEMS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&state->leaves, BIND_RAYSPACE_LEAVES);
    gpu_uniform_uint(program, "instance_count", scene->instance_count);
}

/* Gets the test of rays against primitives, for the materials of the scene. */
static const struct gpu_program *leaf_test_get(const struct rayspace *rayspace, const struct gpu_scene *scene,
                                               const struct rayspace_state *state, struct error *error)
{
    struct gpu_define defines[TRACE_WAVE_DEFINES + 3] = {0};
    size_t n = trace_wave_defines(scene, &state->base.wave, defines);
    defines[n++] = (struct gpu_define){"LEAVES_TEST", "1"};
    if (is_flat(state))
        defines[n++] = (struct gpu_define){"RAYSPACE_FLAT", "1"};
    else if (bvh_is_packed(&rayspace->tree.store.settings))
        defines[n++] = (struct gpu_define){"RAYSPACE_PACKED", "1"};
    const struct gpu_program_source source = {.compute = "rayspace/leaves.comp", .defines = defines};
    return gpu_program_get(scene->device, &source, error);
}

static bool dispatch_leaves(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                            struct error *error)
{
    static const struct gpu_define choices[][2] = {{{"LEAVES_RANK", "1"}}, {{"LEAVES_SETTLE", "1"}}};
    const unsigned count = state->base.wave.kind == WAVE_ANY ? 1 : 3;
    for (unsigned i = 0; i < count; i++) {
        const struct gpu_program *program =
            i == 0 ? leaf_test_get(rayspace, scene, state, error)
                   : rayspace_program_get(scene, state, "rayspace/leaves.comp", choices[i - 1], error);
        if (!program)
            return false;
        bind_descent(scene, rayspace, state, program);
        bind_times(scene, &state->base.wave);
        gpu_dispatch_indirect(program, &state->control, offsetof(struct rayspace_control, leaf_groups_x));
    }
    return true;
}

static void set_tree(const struct gpu_program *program, const struct scene_tree *tree)
{
    gpu_uniform_uint(program, "top_count", tree->top.element_count);
    if (bvh_is_packed(&tree->store.settings)) {
        float cell[3];
        for (int axis = 0; axis < 3; axis++)
            cell[axis] = 1 / tree->top.grid.cells_per_unit[axis];
        gpu_uniform_vec(program, "top_grid_lower", 3, tree->top.grid.lower);
        gpu_uniform_vec(program, "top_cell", 3, cell);
    }
}

static void set_levels(const struct gpu_program *program, const struct rayspace_levels *levels)
{
    for (uint32_t level = 0; level <= levels->top; level++) {
        char name[24];
        snprintf(name, sizeof(name), "level_first[%u]", level);
        gpu_uniform_uint(program, name, levels->first[level]);
        snprintf(name, sizeof(name), "level_count[%u]", level);
        gpu_uniform_uint(program, name, levels->count[level]);
    }
}

static const struct gpu_program *pass_get(const struct rayspace *rayspace, const struct gpu_scene *scene,
                                          const struct rayspace_state *state, struct error *error)
{
    struct gpu_define own[RAYSPACE_DEFINES] = {0};
    size_t n = 0;
    if (is_flat(state))
        own[n++] = (struct gpu_define){"RAYSPACE_FLAT", "1"};
    else if (bvh_is_packed(&rayspace->tree.store.settings))
        own[n++] = (struct gpu_define){"RAYSPACE_PACKED", "1"};
    if (is_paper(&state->base.options))
        own[n++] = (struct gpu_define){"RAYSPACE_SPHERES", "1"};
    if (leaves_slots(state))
        own[n++] = (struct gpu_define){"RAYSPACE_TO_SLOTS", "1"};
    if (trace_has_motion(scene, &state->base.wave))
        own[n++] = (struct gpu_define){"HAS_MOTION", "1"};
    return rayspace_program_get(scene, state, "rayspace/descend.comp", own, error);
}

static bool dispatch_pass(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                          struct error *error)
{
    const struct gpu_program *program = pass_get(rayspace, scene, state, error);
    if (!program)
        return false;
    bind_descent(scene, rayspace, state, program);
    gpu_buffer_bind_texels(scene->device, &state->nodes, UNIT_RAYSPACE_NODES, GL_RGBA32F);
    gpu_buffer_bind_texels(scene->device, stack_taken_from(state), UNIT_RAYSPACE_PAIRS, GL_RGBA32UI);
    gpu_buffer_bind_storage(leaves_slots(state) ? &state->reduction.slots : stack_written_to(state),
                            BIND_RAYSPACE_PAIRS);
    gpu_uniform_uint(program, "to", !state->turn);
    set_tree(program, &rayspace->tree);
    set_levels(program, &state->levels);
    gpu_uniform_float(program, "split_factor", SPLIT_FACTOR);
    gpu_dispatch_indirect(program, &state->control, offsetof(struct rayspace_control, pass_groups_x));
    if (!leaves_slots(state))
        return true;
    const struct rayspace_lists lists = {.control = &state->control,
                                         .pairs = stack_written_to(state),
                                         .leaves = &state->leaves,
                                         .to = !state->turn};
    return rayspace_reduction_run(scene->device, &state->reduction, &lists, error);
}

static void next_pass(struct rayspace_state *state)
{
    state->last_turn = state->turn;
    state->turn = !state->turn;
}

/* Begins the next batch of primitives at the root. */
static bool next_batch(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                       struct error *error)
{
    const bool moves = trace_has_motion(scene, &state->base.wave);
    const struct gpu_define defines[] = {{moves ? "HAS_MOTION" : NULL, "1"}, {0}};
    const struct gpu_program_source source = {.compute = "rayspace/items.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(scene->device, &source, error);
    if (!program)
        return false;
    state->turn = false;
    state->seeds = at_most(rayspace->rank_count - state->next_rank, state->batch_max);
    gpu_buffer_bind_texels(scene->device, &rayspace->ranks, UNIT_RAYSPACE_RANKS, GL_R32UI);
    gpu_buffer_bind_storage(&state->items, BIND_RAYSPACE_ITEMS);
    gpu_buffer_bind_storage(stack_taken_from(state), BIND_RAYSPACE_PAIRS);
    gpu_uniform_uint(program, "instance_count", scene->instance_count);
    gpu_uniform_uint(program, "batch_first", state->next_rank);
    gpu_uniform_uint(program, "batch_count", state->seeds);
    gpu_uniform_uint(program, "root", state->levels.top << RAYSPACE_LEVEL_SHIFT);
    gpu_dispatch(scene->device, program, state->seeds);
    state->next_rank += state->seeds;
    return true;
}

static bool has_more_batches(const struct rayspace *rayspace, const struct rayspace_state *state)
{
    return is_flat(state) && state->next_rank < rayspace->rank_count;
}

/* ---- descent with the host ---- */

/* Descends until about step_end_ns. The host waits for each pass, and skips passes with nothing to do. */
static enum tracer_progress descend_waiting(struct rayspace *rayspace, struct gpu_scene *scene,
                                            struct rayspace_state *state, uint64_t step_end_ns,
                                            struct error *error)
{
    struct rayspace_control *control = &state->told;
    for (;;) {
        if (!dispatch_control(state, scene, state->capacity / 2, RAYSPACE_END_NOTHING, error))
            return TRACER_FAILED;
        gpu_buffer_read(scene->device, &state->control, 0, control, sizeof(*control));
        if (scene->device->lost)
            return tracer_progress_of(gpu_check(scene->device, "tracing", error));
        if (control->failed_in_turn > FAILED_IN_TURN_MAX) { /* no pass succeeds: a mistake of ours */
            error_set(error, ERROR_INTERNAL, NULL, "rayspace: no room for the children of one pair");
            return TRACER_FAILED;
        }
        if (control->leaves_taken > 0 && !dispatch_leaves(rayspace, scene, state, error))
            return TRACER_FAILED;
        if (control->taken > 0 && !dispatch_pass(rayspace, scene, state, error))
            return TRACER_FAILED;
        next_pass(state);
        if (control->waiting_0 + control->waiting_1 + control->leaves > 0) {
            if (step_is_over(step_end_ns))
                return TRACER_MORE;
        } else if (has_more_batches(rayspace, state)) {
            if (!next_batch(rayspace, scene, state, error))
                return TRACER_FAILED;
        } else {
            return TRACER_DONE;
        }
    }
}

/* Adapts the batch by the paper's rule: halved for the next frame if it did not fit, doubled again if twice as
 * much would. */
static void learn(struct rayspace_state *state)
{
    uint8_t *halved = &state->halved[state->base.wave.family];
    if (state->told.halvings > 0 && *halved < 20)
        ++*halved;
    else if (*halved > 0 && state->told.pairs_max < state->capacity / 4)
        --*halved;
}

/* ---- descent without the host ---- */

static bool queue_passes(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                         uint32_t passes, struct error *error)
{
    for (uint32_t i = 0; i < passes; i++) {
        const bool tests = i % PASSES_A_TEST == PASSES_A_TEST - 1;
        if (!dispatch_control(state, scene, tests ? LEAVES_ALL : LEAVES_NONE, RAYSPACE_END_NOTHING, error) ||
            (tests && !dispatch_leaves(rayspace, scene, state, error)) ||
            !dispatch_pass(rayspace, scene, state, error))
            return false;
        next_pass(state);
    }
    return true;
}

/* Queues a fixed number of passes. Pairs that are left after them stop the slice, and a patient state traces
 * the wave again. */
static bool descend_ahead(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                          struct error *error)
{
    const uint32_t passes = is_flat(state) ? state->levels.top + PASSES_FLAT : PASSES_JOINT;
    do {
        if (is_flat(state) && has_more_batches(rayspace, state) && !next_batch(rayspace, scene, state, error))
            return false;
        const uint32_t end = has_more_batches(rayspace, state) ? RAYSPACE_END_BATCH : RAYSPACE_END_WAVE;
        if (!queue_passes(rayspace, scene, state, passes, error) ||
            !dispatch_control(state, scene, LEAVES_ALL, end, error) ||
            !dispatch_leaves(rayspace, scene, state, error))
            return false;
    } while (has_more_batches(rayspace, state));
    return true;
}

enum tracer_progress rayspace_descent_step(struct rayspace *rayspace, struct gpu_scene *scene,
                                           struct rayspace_state *state, uint64_t step_end_ns, struct error *error)
{
    const uint32_t ray_count = state->base.wave.ray_count;
    while (state->disc_rays < ray_count) {
        if (!test_discs(scene, state, error))
            return TRACER_FAILED;
        if (!rayspace_is_ahead(state) && state->disc_rays < ray_count)
            return TRACER_MORE;
    }
    if (state->has_descended)
        return TRACER_DONE;
    if (!state->has_nodes && !make_nodes(rayspace, scene, state, error))
        return TRACER_FAILED;
    if (rayspace_is_ahead(state))
        return tracer_progress_of(descend_ahead(rayspace, scene, state, error));
    const enum tracer_progress progress = descend_waiting(rayspace, scene, state, step_end_ns, error);
    state->has_descended = progress == TRACER_DONE;
    if (state->has_descended)
        learn(state);
    return progress;
}

enum tracer_progress rayspace_descent_finish(struct rayspace *rayspace, struct gpu_scene *scene,
                                             struct rayspace_state *state, struct error *error)
{
    const struct wave *wave = &state->base.wave;
    const struct trace_program_source source = {.traverse = "rayspace/traverse.glsl"};
    const struct gpu_program *program = trace_program_get(scene, wave, &source, error);
    if (!program)
        return TRACER_FAILED;
    struct ray_range rays = {.wave = wave, .first = state->finished_rays, .end = wave->ray_count};
    if (!rayspace_is_ahead(state))
        rays.end = end_of_range(scene, state, rays.first);
    gpu_buffer_bind_texels(scene->device, &rayspace->ranks, UNIT_RAYSPACE_RANKS, GL_R32UI);
    gpu_buffer_bind_storage(&state->answers, BIND_RAYSPACE_ANSWERS);
    trace_program_run(program, scene, &rays, &source);
    state->finished_rays = rays.end;
    return rays.end < wave->ray_count ? TRACER_MORE : TRACER_DONE;
}
