/* SPDX-License-Identifier: MIT */
#include "render/compact.h"

#include "shared/bindings.h"
#include "shared/path.h"

static uint32_t block_count_of(uint32_t item_count)
{
    return (item_count + COMPACT_BLOCK - 1) / COMPACT_BLOCK;
}

bool compact_scan(struct render_context *context, const struct gpu_program *count, uint32_t item_count,
                  struct wave_state *state, struct error *error)
{
    gpu_buffer_bind_storage(&context->block_offsets, BIND_BLOCK_OFFSETS);
    gpu_dispatch(context->device, count, block_count_of(item_count));
    const struct gpu_program *scan = context_use(context, "render/compact_scan.comp", error);
    if (!scan)
        return false;
    gpu_buffer_bind_storage(&context->wave_state, BIND_WAVE);
    gpu_uniform_uint(scan, "block_count", block_count_of(item_count));
    gpu_dispatch(context->device, scan, 1);
    gpu_buffer_read(context->device, &context->wave_state, 0, state, sizeof(*state));
    return gpu_check(context->device, "compacting", error);
}

bool compact_hits(struct render_context *context, struct error *error)
{
    struct wave_state state = {0};
    const struct gpu_program *count = context_use(context, "render/hit_count.comp", error);
    if (!count)
        return false;
    gpu_uniform_uint(count, "ray_count", context->ray_count);
    gpu_buffer_bind_storage(&context->hits, BIND_HITS);
    if (!compact_scan(context, count, context->ray_count, &state, error))
        return false;
    const struct gpu_program *list = context_use(context, "render/hit_list.comp", error);
    if (!list)
        return false;
    gpu_uniform_uint(list, "ray_count", context->ray_count);
    gpu_buffer_bind_storage(&context->hit_list, BIND_HIT_LIST);
    gpu_buffer_bind_storage(&context->hit_places, BIND_HIT_PLACES);
    gpu_dispatch(context->device, list, block_count_of(context->ray_count));
    context->hit_count = state.ray_count;
    return true;
}
