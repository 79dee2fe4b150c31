/* SPDX-License-Identifier: MIT */
/* The stages of a build that sort the lists of texels: up to four samples, up to eight, and beyond. */
#include "abuffer/layout.h"
#include "shared/bindings.h"
#include "trace/abuffer/build_state.h"

#include <epoxy/gl.h>

/* Maximum of texels with more than ABUFFER_FOUR samples. */
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
    /* The traversal reads samples two per texel. */
    return gpu_buffer_reserve(device, &store->samples, (nodes + nodes % 2) * ABUFFER_SAMPLE_BYTES, error) &&
           gpu_buffer_reserve(device, &store->ids, nodes * ABUFFER_ID_BYTES, error) &&
           gpu_buffer_reserve(device, &builder->longer, longer_max(task) * sizeof(uint32_t), error) &&
           gpu_buffer_reserve(device, &builder->deep, deep * sizeof(uint32_t), error);
}

/* Gets the program and binds what all passes over items first .. end - 1 of a list read and write. */
static const struct gpu_program *use(struct abuffer_task *task, const struct gpu_program_source *source,
                                     uint32_t first, uint32_t end, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const struct gpu_program *program = gpu_program_get(device, source, error);
    if (!program)
        return NULL;
    gpu_buffer_bind_texels(device, &builder->heads, UNIT_ABUFFER_HEADS, GL_R32UI);
    gpu_buffer_bind_texels(device, &builder->nodes, UNIT_ABUFFER_NODES, GL_RGBA32UI);
    gpu_buffer_bind_image(device, &task->store->samples, IMAGE_ABUFFER_SAMPLES, GL_RG32UI);
    gpu_buffer_bind_image(device, &task->store->ids, IMAGE_ABUFFER_IDS, GL_R32UI);
    gpu_uniform_uint(program, "first_item", first);
    gpu_uniform_uint(program, "end_item", end);
    return program;
}

bool abuffer_resolve_begin(struct abuffer_task *task, uint32_t *items, struct error *error)
{
    *items = task->counts.nodes > 0 ? task->counts.occupied : 0;
    return task->counts.nodes == 0 || reserve(task, error);
}

bool abuffer_resolve_run(struct abuffer_task *task, uint32_t first, uint32_t end, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const struct gpu_program_source source = {.compute = "abuffer/resolve.comp"};
    const struct gpu_program *program = use(task, &source, first, end, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(device, &builder->occupied, UNIT_ABUFFER_OCCUPIED, GL_R32UI);
    gpu_buffer_bind_image(device, &task->store->texels, IMAGE_ABUFFER_TEXELS, GL_RG32UI);
    gpu_buffer_bind_image(device, &builder->longer, IMAGE_ABUFFER_LONGER, GL_R32UI);
    gpu_buffer_bind_image(device, &builder->deep, IMAGE_ABUFFER_DEEP, GL_R32UI);
    gpu_buffer_bind_storage(&builder->build, BIND_ABUFFER_BUILD_COUNTS);
    gpu_uniform_uint(program, "longer_max", longer_max(task));
    gpu_dispatch(device, program, end - first);
    return true;
}

bool abuffer_resolve_end(struct abuffer_task *task, struct error *error)
{
    (void)error;
    abuffer_read_counts(task);
    task->store->sample_count = task->counts.nodes;
    task->store->depth_max = task->counts.depth_max;
    return true;
}

/* Runs a pass over items first .. end - 1 of `longer`. */
static bool resolve_longer(struct abuffer_task *task, const struct gpu_program_source *source, uint32_t first,
                           uint32_t end, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    const struct gpu_program *program = use(task, source, first, end, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(builder->device, &builder->longer, UNIT_ABUFFER_LONGER, GL_R32UI);
    gpu_buffer_bind_texels(builder->device, &task->store->texels, UNIT_ABUFFER_TEXELS, GL_RG32UI);
    gpu_dispatch(builder->device, program, end - first);
    return true;
}

bool abuffer_up_to_eight_begin(struct abuffer_task *task, uint32_t *items, struct error *error)
{
    (void)error;
    *items = task->counts.up_to_eight;
    return true;
}

bool abuffer_up_to_eight_run(struct abuffer_task *task, uint32_t first, uint32_t end, struct error *error)
{
    static const struct gpu_define eight[] = {{"RESOLVE_EIGHT", "1"}, {0}};
    static const struct gpu_program_source up_to_eight = {.compute = "abuffer/resolve.comp", .defines = eight};
    return resolve_longer(task, &up_to_eight, first, end, error);
}

bool abuffer_beyond_eight_begin(struct abuffer_task *task, uint32_t *items, struct error *error)
{
    (void)error;
    *items = task->counts.beyond_eight;
    return true;
}

bool abuffer_beyond_eight_run(struct abuffer_task *task, uint32_t first, uint32_t end, struct error *error)
{
    static const struct gpu_program_source beyond_eight = {.compute = "abuffer/sort.comp"};
    const uint32_t from = longer_max(task) - task->counts.beyond_eight;
    return resolve_longer(task, &beyond_eight, from + first, from + end, error);
}
