/* SPDX-License-Identifier: MIT */
#include "trace/abuffer_build.h"

#include "trace/abuffer_build_state.h"

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

void abuffer_builder_destroy(struct abuffer_builder *builder)
{
    if (!builder)
        return;
    struct gpu_buffer *buffers[BUFFER_COUNT];
    list_buffers(builder, buffers);
    for (int i = 0; i < BUFFER_COUNT; i++)
        gpu_buffer_finish(builder->device, buffers[i]);
    axes_draw_finish(&builder->draw);
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

void abuffer_builder_start_with(struct abuffer_builder *builder, uint32_t fragments)
{
    gpu_buffer_finish(builder->device, &builder->nodes);
    builder->nodes_max = 0;
    builder->nodes_first = fragments;
}

uint32_t abuffer_builder_passes(const struct abuffer_builder *builder)
{
    return builder->passes;
}

void abuffer_read_counts(struct abuffer_task *task)
{
    gpu_buffer_read(task->builder->device, &task->builder->build, 0, &task->counts, sizeof(task->counts));
}

/* Of the whole scene, for the draws that follow. */
static bool list_instances(struct abuffer_builder *builder, const struct scene_gpu *scene, struct error *error)
{
    uint32_t *instances = NULL, count = 0;
    bool listed = axes_list_instances(scene, &instances, &count, error) &&
                  axes_draw_prepare(&builder->draw, scene, instances, count, error);
    free(instances);
    return listed;
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
           gpu_buffer_reserve(device, &store->texels, (size_t)task->texel_count * ABUFFER_TEXEL_BYTES, error);
}

/* The table that ids are looked up in goes with them. */
static bool copy_drawn(struct abuffer_task *task, struct error *error)
{
    const struct axes_draw *draw = &task->builder->draw;
    struct abuffer_store *store = task->store;
    if (!gpu_buffer_reserve(store->device, &store->drawn, draw->drawn.size_bytes, error))
        return false;
    glCopyNamedBufferSubData(draw->drawn.name, store->drawn.name, 0, 0, (GLsizeiptr)draw->drawn.size_bytes);
    store->drawn_count = draw->drawn_count;
    return true;
}

static bool build(struct abuffer_task *task, struct error *error)
{
    if (!list_instances(task->builder, task->scene, error))
        return false;
    if (task->builder->draw.drawn_count == 0) {
        abuffer_store_finish(task->store);
        return true;
    }
    return reserve(task, error) && copy_drawn(task, error) && abuffer_lists(task, error) &&
           abuffer_runs(task, error) && gpu_check(task->builder->device, "building A-buffers", error);
}

bool abuffer_build(struct abuffer_builder *builder, struct abuffer_store *store, struct scene_gpu *scene,
                   const struct tracer_options *options, struct error *error)
{
    const uint32_t tiles_along = ABUFFER_TILES_ALONG(store->resolution);
    struct abuffer_task task = {
        .builder = builder,
        .store = store,
        .scene = scene,
        .options = options,
        .texel_count = 3 * tiles_along * tiles_along * ABUFFER_TILE_TEXELS,
    };
    store->sample_count = 0;
    store->depth_max = 0;
    builder->passes = 0;
    scene_gpu_bind(scene);
    gpu_push_group(builder->device, "build A-buffers");
    bool built = build(&task, error);
    gpu_pop_group(builder->device);
    if (!built)
        abuffer_store_finish(store);
    return built;
}
