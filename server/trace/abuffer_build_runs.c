/* SPDX-License-Identifier: MIT */
#include "shared/bindings.h"
#include "trace/abuffer_build_state.h"

#include <epoxy/gl.h>

/* That may have more than ABUFFER_FOUR samples. */
static uint32_t longer_max(const struct abuffer_task *task)
{
    return task->counts.nodes / (ABUFFER_FOUR + 1) + 1;
}

static bool reserve(struct abuffer_task *task, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    struct abuffer_store *store = task->store;
    size_t nodes = task->counts.nodes, deep = nodes / ABUFFER_LIST_MAX + 1;
    /* The walk reads samples two a texel. */
    return gpu_buffer_reserve(device, &store->samples, (nodes + nodes % 2) * ABUFFER_SAMPLE_BYTES, error) &&
           gpu_buffer_reserve(device, &store->ids, nodes * ABUFFER_ID_BYTES, error) &&
           gpu_buffer_reserve(device, &builder->longer, longer_max(task) * sizeof(uint32_t), error) &&
           gpu_buffer_reserve(device, &builder->deep, deep * sizeof(uint32_t), error);
}

/* Binds what all of them read and write. */
static const struct gpu_program *use(struct abuffer_task *task, const struct gpu_program_source *source,
                                     uint32_t item_count, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const struct gpu_program *program = gpu_program_get(device, source, error);
    if (!program)
        return NULL;
    glUseProgram(program->name);
    gpu_buffer_bind_texels(device, &builder->heads, UNIT_ABUFFER_HEADS, GL_R32UI);
    gpu_buffer_bind_texels(device, &builder->nodes, UNIT_ABUFFER_NODES, GL_RGBA32UI);
    gpu_buffer_bind_image(device, &task->store->samples, IMAGE_ABUFFER_SAMPLES, GL_RG32UI);
    gpu_buffer_bind_image(device, &task->store->ids, IMAGE_ABUFFER_IDS, GL_R32UI);
    gpu_uniform_uint(program, "item_count", item_count);
    return program;
}

static bool resolve(struct abuffer_task *task, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const struct gpu_program_source source = {.compute = "abuffer/resolve.comp"};
    const struct gpu_program *program = use(task, &source, task->counts.occupied, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(device, &builder->occupied, UNIT_ABUFFER_OCCUPIED, GL_R32UI);
    gpu_buffer_bind_image(device, &task->store->texels, IMAGE_ABUFFER_TEXELS, GL_RG32UI);
    gpu_buffer_bind_image(device, &builder->longer, IMAGE_ABUFFER_LONGER, GL_R32UI);
    gpu_buffer_bind_image(device, &builder->deep, IMAGE_ABUFFER_DEEP, GL_R32UI);
    gpu_buffer_bind_storage(&builder->build, BIND_ABUFFER_BUILD_COUNTS);
    gpu_uniform_uint(program, "longer_max", longer_max(task));
    gpu_dispatch(device, program, task->counts.occupied);
    abuffer_read_counts(task);
    return true;
}

/* `count` of `longer`. */
static bool resolve_longer(struct abuffer_task *task, const struct gpu_program_source *source, uint32_t first,
                           uint32_t count, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    if (count == 0)
        return true;
    const struct gpu_program *program = use(task, source, count, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(builder->device, &builder->longer, UNIT_ABUFFER_LONGER, GL_R32UI);
    gpu_buffer_bind_texels(builder->device, &task->store->texels, UNIT_ABUFFER_TEXELS, GL_RG32UI);
    gpu_uniform_uint(program, "first_item", first);
    gpu_dispatch(builder->device, program, count);
    return true;
}

bool abuffer_runs(struct abuffer_task *task, struct error *error)
{
    static const struct gpu_define eight[] = {{"RESOLVE_EIGHT", "1"}, {0}};
    static const struct gpu_program_source up_to_eight = {.compute = "abuffer/resolve.comp", .defines = eight};
    static const struct gpu_program_source beyond_eight = {.compute = "abuffer/sort.comp"};
    struct abuffer_store *store = task->store;
    gpu_buffer_clear(task->builder->device, &store->texels, 0);
    if (task->counts.nodes == 0)
        return true;
    if (!reserve(task, error) || !resolve(task, error) ||
        !resolve_longer(task, &up_to_eight, 0, task->counts.up_to_eight, error) ||
        !resolve_longer(task, &beyond_eight, longer_max(task) - task->counts.beyond_eight,
                        task->counts.beyond_eight, error))
        return false;
    store->sample_count = task->counts.nodes;
    store->depth_max = task->counts.depth_max;
    return task->counts.deep == 0 || abuffer_runs_deep(task, error);
}
