/* SPDX-License-Identifier: MIT */
#include "shared/bindings.h"
#include "trace/abuffer_build_state.h"

#include <epoxy/gl.h>

static bool reserve(struct abuffer_task *task, struct error *error)
{
    struct gpu_device *device = task->builder->device;
    struct abuffer_store *store = task->store;
    uint32_t nodes = task->counts.nodes;
    size_t deep = (size_t)nodes / ABUFFER_LIST_MAX + 1;
    return gpu_buffer_reserve(device, &store->samples, (size_t)nodes * ABUFFER_SAMPLE_BYTES, error) &&
           gpu_buffer_reserve(device, &store->ids, (size_t)nodes * ABUFFER_ID_BYTES, error) &&
           gpu_buffer_reserve(device, &task->builder->deep, deep * sizeof(uint32_t), error);
}

static const struct gpu_program *use(struct abuffer_task *task, const char *path, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const struct gpu_program *program =
        gpu_program_get(device, &(struct gpu_program_source){.compute = path}, error);
    if (!program)
        return NULL;
    glUseProgram(program->name);
    gpu_buffer_bind_texels(device, &builder->occupied, UNIT_ABUFFER_OCCUPIED, GL_R32UI);
    gpu_buffer_bind_image(device, &task->store->samples, IMAGE_ABUFFER_SAMPLES, GL_RG32UI);
    gpu_buffer_bind_image(device, &task->store->ids, IMAGE_ABUFFER_IDS, GL_R32UI);
    gpu_uniform_uint(program, "occupied_count", task->counts.occupied);
    return program;
}

static bool resolve(struct abuffer_task *task, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const struct gpu_program *program = use(task, "abuffer/resolve.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(device, &builder->heads, UNIT_ABUFFER_HEADS, GL_R32UI);
    gpu_buffer_bind_texels(device, &builder->nodes, UNIT_ABUFFER_NODES, GL_RGBA32UI);
    gpu_buffer_bind_image(device, &task->store->texels, IMAGE_ABUFFER_TEXELS, GL_RG32UI);
    gpu_buffer_bind_image(device, &builder->deep, IMAGE_ABUFFER_DEEP, GL_R32UI);
    gpu_buffer_bind_storage(&builder->build, BIND_ABUFFER_BUILD_COUNTS);
    gpu_dispatch(device, program, (task->counts.occupied + ABUFFER_RESOLVE_TEXELS - 1) / ABUFFER_RESOLVE_TEXELS);
    return true;
}

static bool sort(struct abuffer_task *task, struct error *error)
{
    const struct gpu_program *program = use(task, "abuffer/sort.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(task->builder->device, &task->store->texels, UNIT_ABUFFER_TEXELS, GL_RG32UI);
    gpu_dispatch(task->builder->device, program, task->counts.occupied);
    return true;
}

bool abuffer_runs(struct abuffer_task *task, struct error *error)
{
    struct abuffer_store *store = task->store;
    gpu_buffer_clear(task->builder->device, &store->texels, 0);
    if (task->counts.nodes == 0)
        return true;
    if (!reserve(task, error) || !resolve(task, error))
        return false;
    abuffer_read_counts(task);
    if (task->counts.depth_max > ABUFFER_RESOLVE_SORTS && !sort(task, error))
        return false;
    store->sample_count = task->counts.nodes;
    store->depth_max = task->counts.depth_max;
    return task->counts.deep == 0 || abuffer_runs_deep(task, error);
}
