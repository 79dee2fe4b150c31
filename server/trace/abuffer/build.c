/* SPDX-License-Identifier: MIT */
/* Builds of A-buffers: the stages in order, unit by unit, each with its items. */
#include "trace/abuffer/build.h"

#include "base/clock.h"
#include "trace/abuffer/build_state.h"
#include "trace/abuffer/trace.h"
#include "trace/abuffer/voxels.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

struct abuffer_builder *abuffer_builder_create(struct gpu_device *device, struct error *error)
{
    struct abuffer_builder *builder = calloc(1, sizeof(*builder));
    if (!builder) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a builder of A-buffers");
        return NULL;
    }
    builder->device = device;
    axes_draw_init(&builder->draw, device);
    return builder;
}

#define BUFFER_COUNT 6

static void list_buffers(struct abuffer_builder *builder, struct gpu_buffer *buffers[BUFFER_COUNT])
{
    struct gpu_buffer *all[BUFFER_COUNT] = {&builder->heads,  &builder->nodes, &builder->occupied,
                                            &builder->longer, &builder->deep,  &builder->build};
    for (int i = 0; i < BUFFER_COUNT; i++)
        buffers[i] = all[i];
}

void abuffer_builder_clear(struct abuffer_builder *builder)
{
    struct gpu_buffer *buffers[BUFFER_COUNT];
    list_buffers(builder, buffers);
    for (int i = 0; i < BUFFER_COUNT; i++)
        gpu_buffer_finish(builder->device, buffers[i]);
    axes_draw_finish(&builder->draw);
    axes_draw_init(&builder->draw, builder->device);
    builder->nodes_max = 0;
}

void abuffer_builder_destroy(struct abuffer_builder *builder)
{
    if (!builder)
        return;
    abuffer_deep_end(&builder->task);
    abuffer_builder_clear(builder);
    free(builder);
}

uint64_t abuffer_builder_bytes(const struct abuffer_builder *builder)
{
    struct gpu_buffer *buffers[BUFFER_COUNT];
    struct abuffer_builder copy = *builder;
    uint64_t bytes = builder->draw.drawn.capacity_bytes + builder->draw.commands.capacity_bytes;
    list_buffers(&copy, buffers);
    for (int i = 0; i < BUFFER_COUNT; i++)
        bytes += buffers[i]->capacity_bytes;
    return bytes;
}

void abuffer_read_counts(struct abuffer_task *task)
{
    gpu_buffer_read(task->builder->device, &task->builder->build, 0, &task->counts, sizeof(task->counts));
}

static bool reserve(struct abuffer_task *task, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    struct abuffer_store *store = task->store;
    struct gpu_device *device = builder->device;
    uint64_t voxels = (uint64_t)store->voxels_along * store->voxels_along * store->voxels_along;
    if (task->texel_count > device->facts.texture_buffer_texels_max)
        return error_set(error, ERROR_LIMIT, "options.abuffer_resolution",
                         "%u texels are more than the device takes", task->texel_count);
    if (4 * voxels > device->facts.texture_buffer_texels_max)
        return error_set(error, ERROR_LIMIT, "options.abuffer_voxels",
                         "%llu voxels are more than the device takes", (unsigned long long)voxels);
    size_t subvoxels = abuffer_has_subvoxels(store) ? (size_t)voxels : 1;
    size_t texel_numbers = (size_t)task->texel_count * sizeof(uint32_t);
    return abuffer_texels_allowed(task, error) &&
           gpu_buffer_reserve(device, &builder->heads, texel_numbers, error) &&
           gpu_buffer_reserve(device, &builder->occupied, texel_numbers, error) &&
           gpu_buffer_reserve(device, &builder->build, sizeof(task->counts), error) &&
           gpu_buffer_reserve(device, &store->sums, (size_t)voxels * ABUFFER_SUM_BYTES, error) &&
           gpu_buffer_reserve(device, &store->subvoxels, subvoxels * ABUFFER_SUBVOXELS_BYTES, error) &&
           gpu_buffer_reserve(device, &store->texels, (size_t)task->texel_count * ABUFFER_TEXEL_BYTES, error) &&
           abuffer_voxels_reserve(store, error) && abuffer_lists_reserve(task, error);
}

/* Copies the table that ids are looked up in, so that the store outlives the list of draws. */
static bool copy_drawn(struct abuffer_task *task, struct error *error)
{
    const struct axes_draw *draw = &task->builder->draw;
    struct abuffer_store *store = task->store;
    if (!gpu_buffer_reserve(store->device, &store->drawn, draw->drawn.size_bytes, error))
        return false;
    gpu_buffer_copy(store->device, (struct gpu_buffer_place){&draw->drawn, 0},
                    (struct gpu_buffer_place){&store->drawn, 0}, draw->drawn.size_bytes);
    store->drawn_count = draw->drawn_count;
    return true;
}

/* ---- stages ---- */

static bool voxels_begin(struct abuffer_task *task, uint32_t *items, struct error *error)
{
    (void)error;
    *items = abuffer_voxel_blocks(task->store);
    return true;
}

static bool voxels_run(struct abuffer_task *task, uint32_t first, uint32_t end, struct error *error)
{
    return abuffer_voxels_pass(task->store, task->stage - ABUFFER_VOXELS_JUDGE, first, end, error);
}

/* Stages in order. The first unit of a stage has this many items, times step_scale. */
static const struct stage_functions {
    abuffer_stage_begin *begin;
    abuffer_stage_run *run;
    abuffer_stage_end *end; /* NULL: nothing */
    uint32_t unit_items;
    abuffer_stage_fit *fit; /* NULL: all items take about as long */
} stages[ABUFFER_STAGES] = {
    [ABUFFER_CLEAR] = {abuffer_clear_begin, abuffer_clear_run, NULL, 64, NULL},
    [ABUFFER_DRAW] = {abuffer_draw_begin, abuffer_draw_run, NULL, 2048, abuffer_draw_fit},
    [ABUFFER_OCCUPIED] = {abuffer_occupied_begin, abuffer_occupied_run, abuffer_occupied_end, 4096, NULL},
    [ABUFFER_RESOLVE] = {abuffer_resolve_begin, abuffer_resolve_run, abuffer_resolve_end, 4096, NULL},
    [ABUFFER_UP_TO_EIGHT] = {abuffer_up_to_eight_begin, abuffer_up_to_eight_run, NULL, 2048, NULL},
    [ABUFFER_BEYOND_EIGHT] = {abuffer_beyond_eight_begin, abuffer_beyond_eight_run, NULL, 1024, NULL},
    [ABUFFER_DEEP] = {abuffer_deep_begin, abuffer_deep_run, NULL, 1, NULL},
    [ABUFFER_VOXELS_JUDGE] = {voxels_begin, voxels_run, NULL, 512, NULL},
    [ABUFFER_VOXELS_REACH_X] = {voxels_begin, voxels_run, NULL, 1024, NULL},
    [ABUFFER_VOXELS_REACH_Y] = {voxels_begin, voxels_run, NULL, 1024, NULL},
    [ABUFFER_VOXELS_REACH_Z] = {voxels_begin, voxels_run, NULL, 1024, NULL},
};

static uint32_t *unit_of(struct abuffer_task *task)
{
    struct abuffer_builder *builder = task->builder;
    uint32_t *items = &builder->unit_items[task->stage];
    if (*items == 0)
        *items = stages[task->stage].unit_items * builder->device->facts.step_scale;
    return items;
}

/* Runs items of the current stage for about a unit's time, or all that are left where nobody waits. */
static bool run_unit(struct abuffer_task *task, uint64_t step_end_ns, struct error *error)
{
    const bool whole = step_end_ns == STEP_WITHOUT_END;
    const uint32_t first = task->next_item, left = task->end_item - first;
    uint32_t *unit = unit_of(task), items = whole || left < *unit ? left : *unit;
    const uint64_t start_ns = clock_now_ns();
    if (items == 0)
        return true;
    if (stages[task->stage].fit && (!whole || task->band_count > 0))
        items = stages[task->stage].fit(task, first, items);
    if (!stages[task->stage].run(task, first, first + items, error))
        return false;
    if (task->band_count == 0 || ++task->band == task->band_count) {
        task->band_count = 0;
        task->next_item += items;
    }
    if (whole)
        return true;
    gpu_finish(task->builder->device); /* else the last unit would include the time of all before it */
    if (items == *unit)
        *unit = step_batch_items(items, clock_now_ns() - start_ns);
    return true;
}

static bool end_stage(struct abuffer_task *task, struct error *error)
{
    const enum abuffer_stage ended = task->stage;
    task->stage = ended + 1;
    task->stage_begun = false;
    return !stages[ended].end || stages[ended].end(task, error);
}

/* Runs a unit, with the beginning and the end of its stage where it reaches them. */
static bool run_stage(struct abuffer_task *task, uint64_t step_end_ns, struct error *error)
{
    if (!task->stage_begun) {
        task->next_item = 0;
        if (!stages[task->stage].begin(task, &task->end_item, error))
            return false;
        task->stage_begun = true;
    }
    if (!run_unit(task, step_end_ns, error))
        return false;
    return task->next_item < task->end_item || end_stage(task, error);
}

/* ---- builds ---- */

static void forget(struct abuffer_builder *builder)
{
    abuffer_deep_end(&builder->task);
    builder->task = (struct abuffer_task){0};
}

bool abuffer_build_begin(struct abuffer_builder *builder, struct abuffer_store *store, struct gpu_scene *scene,
                         const uint32_t *instances, uint32_t instance_count, const struct tracer_options *options,
                         struct error *error)
{
    const uint32_t tiles_along = ABUFFER_TILES_ALONG(store->resolution);
    struct abuffer_task *task = &builder->task;
    forget(builder);
    *task = (struct abuffer_task){
        .builder = builder,
        .store = store,
        .scene = scene,
        .options = options,
        .texel_count = 3 * tiles_along * tiles_along * ABUFFER_TILE_TEXELS,
    };
    store->whole_voxels = options->abuffer.form == TRACER_FORM_PAPER;
    store->without_steep = !store->whole_voxels;
    store->sample_count = 0;
    store->depth_max = 0;
    builder->passes = 0;
    bool begun = axes_draw_prepare(&builder->draw, scene, instances, instance_count, error);
    if (begun && builder->draw.drawn_count == 0) {
        abuffer_store_finish(store);
        task->stage = ABUFFER_STAGES;
    } else if (begun) {
        begun = reserve(task, error) && copy_drawn(task, error);
    }
    if (!begun)
        abuffer_build_abandon(builder);
    return begun;
}

enum tracer_progress abuffer_build_step(struct abuffer_builder *builder, uint64_t step_end_ns, struct error *error)
{
    struct abuffer_task *task = &builder->task;
    bool good = true;
    gpu_scene_bind(task->scene);
    gpu_push_group(builder->device, "build A-buffers");
    do {
        good = task->stage == ABUFFER_STAGES || run_stage(task, step_end_ns, error);
    } while (good && task->stage != ABUFFER_STAGES && !step_is_over(step_end_ns));
    gpu_pop_group(builder->device);
    good = good && gpu_check(builder->device, "building A-buffers", error);
    if (good && task->stage != ABUFFER_STAGES)
        return TRACER_MORE;
    if (good)
        forget(builder);
    else
        abuffer_build_abandon(builder);
    return tracer_progress_of(good);
}

void abuffer_build_abandon(struct abuffer_builder *builder)
{
    if (builder->task.store)
        abuffer_store_finish(builder->task.store);
    forget(builder);
}

bool abuffer_build_is_on(const struct abuffer_builder *builder)
{
    return builder->task.store != NULL;
}
