/* SPDX-License-Identifier: MIT */
/* One pass over the scene: every fragment goes into a list, in any order, and its texel counts it; then all go to
 * their texels' places. */
#include "shared/bindings.h"
#include "trace/ldc_build_state.h"

#include <epoxy/gl.h>

#define FRAGMENT_BYTES 16
#define ORDERED_BYTES 8

static void set_list(const struct ldc_task *task, const struct gpu_program *program)
{
    gpu_uniform_uint(program, "fragments_max", task->builder->fragments_max);
}

/* Of fragments there was room for all, or task->counts says how many there are. */
static bool draw_lists(struct ldc_task *task, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    gpu_buffer_clear(device, &builder->counts, 0);
    gpu_buffer_clear(device, &builder->build, 0);
    gpu_buffer_bind_image(device, &builder->counts, IMAGE_LDC_COUNTS, GL_R32UI);
    gpu_buffer_bind_image(device, &builder->fragments, IMAGE_LDC_FRAGMENTS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&builder->build, BIND_LDC_BUILD_COUNTS);
    if (!ldc_draw_bind_plain(task, error) || !ldc_draw(task, LDC_PASS_LISTS, set_list, error))
        return false;
    ldc_read_counts(task);
    return true;
}

static bool reserve_fragments(struct ldc_task *task, uint32_t count, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    if (count > builder->device->facts.texture_buffer_texels_max)
        return error_set(error, ERROR_LIMIT, NULL, "%u fragments; this device's texel buffers hold %llu", count,
                         (unsigned long long)builder->device->facts.texture_buffer_texels_max);
    builder->fragments_max = 0;
    if (!gpu_buffer_reserve(builder->device, &builder->fragments, (size_t)count * FRAGMENT_BYTES, error))
        return false;
    builder->fragments_max = count;
    return true;
}

static bool order(struct ldc_task *task, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const struct gpu_program *program = ldc_use(device, "ldc/order.comp", error);
    if (!program ||
        !gpu_buffer_reserve(device, &builder->ordered, (size_t)task->counts.fragments * ORDERED_BYTES, error))
        return false;
    gpu_buffer_bind_texels(device, &builder->fragments, UNIT_LDC_FRAGMENTS, GL_RGBA32UI);
    gpu_buffer_bind_texels(device, &builder->places, UNIT_LDC_PLACES, GL_R32UI);
    gpu_buffer_bind_image(device, &builder->ordered, IMAGE_LDC_ORDERED, GL_RG32UI);
    gpu_uniform_uint(program, "fragment_count", task->counts.fragments);
    gpu_dispatch(device, program, task->counts.fragments);
    task->ordered_count = task->counts.fragments;
    return true;
}

bool ldc_lists(struct ldc_task *task, struct error *error)
{
    if (task->builder->fragments_max == 0 && !reserve_fragments(task, task->texel_count / 2, error))
        return false;
    if (!draw_lists(task, error))
        return false;
    if (task->counts.fragments > task->builder->fragments_max) {
        /* Once more with room for all: the next build starts with it. */
        if (!reserve_fragments(task, task->counts.fragments + task->counts.fragments / 8, error) ||
            !draw_lists(task, error))
            return false;
    }
    return ldc_give_places(task, true, error) && (task->counts.fragments == 0 || order(task, error));
}
