/* SPDX-License-Identifier: MIT */
#include "render/waves/compact.h"

#include "host_passes/host_passes.h"
#include "shared/bindings.h"
#include "shared/path.h"

#include <stddef.h>

static uint32_t blocks_of(uint32_t item_count)
{
    return (item_count + COMPACT_BLOCK - 1) / COMPACT_BLOCK;
}

/* As the device counts them. */
static struct wave_counts counts_of(uint32_t count)
{
    const uint32_t groups = (count + 63) / 64, x = groups < WAVE_GROUPS_MAX ? groups : WAVE_GROUPS_MAX;
    return (struct wave_counts){count, x, x > 0 ? (groups + x - 1) / x : 1, 1};
}

void compact_begin(struct render_context *context)
{
    struct wave_state *state = &context->known_state;
    context->shadow_rays = 0;
    *state = (struct wave_state){.rays = counts_of(context->ray_count),
                                 .ray_blocks = counts_of(blocks_of(context->ray_count))};
    /* But for what became of the slices that are in flight. */
    gpu_buffer_write(context->device, &context->wave_state, 0, state, offsetof(struct wave_state, stopped));
}

void compact_go_on(struct render_context *context)
{
    const uint32_t nothing = 0;
    gpu_buffer_write(context->device, &context->wave_state, offsetof(struct wave_state, stopped), &nothing,
                     sizeof(nothing));
}

static void stop_in(struct render_context *context, struct wave *wave)
{
    wave->stopped = wave->counts ? &context->wave_state : NULL;
    wave->stopped_word = offsetof(struct wave_state, stopped) / sizeof(uint32_t);
}

/* Without counts_on_host: the maximum. */
static uint32_t count_of(const struct render_context *context, enum wave_list list)
{
    switch (list) {
    case WAVE_RAYS:
        return context->ray_count;
    case WAVE_RAY_BLOCKS:
        return blocks_of(context->ray_count);
    case WAVE_HITS:
        return context->hit_count;
    case WAVE_HIT_BLOCKS:
        return blocks_of(context->hit_count);
    case WAVE_SHADOW_RAYS:
        break;
    }
    return 0;
}

void compact_dispatch(struct render_context *context, const struct gpu_program *program, enum wave_list list)
{
    gpu_buffer_bind_uniform(&context->wave_state, UNIFORM_WAVE);
    if (context->counts_on_host)
        gpu_dispatch(context->device, program, count_of(context, list));
    else
        gpu_dispatch_indirect(program, &context->wave_state,
                              list * sizeof(struct wave_counts) + offsetof(struct wave_counts, groups_x));
}

/* In use. `hits`: of rays, else of hits. */
static const struct gpu_program *use_scan(struct render_context *context, bool hits, struct error *error)
{
    static const struct gpu_define of_hits[] = {{"HITS", "1"}, {NULL, NULL}};
    return context_use_with(context, "render/compact_scan.comp", hits ? of_hits : NULL, error);
}

/* The blocks' counts become places, and their sum the wave's. `program` is in use. */
static bool scan(struct render_context *context, const struct gpu_program *program, struct error *error)
{
    gpu_buffer_bind_storage(&context->block_offsets, BIND_BLOCK_OFFSETS);
    gpu_buffer_bind_storage(&context->wave_state, BIND_WAVE);
    gpu_dispatch(context->device, program, 1); /* one group */
    if (context->counts_on_host)
        gpu_buffer_read(context->device, &context->wave_state, 0, &context->known_state,
                        sizeof(context->known_state));
    return gpu_check(context->device, "compacting", error);
}

/* As the scans do. */
static void write_state(struct render_context *context)
{
    gpu_buffer_write(context->device, &context->wave_state, 0, &context->known_state,
                     sizeof(context->known_state));
}

/* Passes by the host, which has to know the counts. */
static const struct host_passes *host_of(const struct render_context *context)
{
    return context->counts_on_host ? host_passes_of(context->device) : NULL;
}

static bool list_hits(const struct host_passes *host, struct render_context *context, struct error *error)
{
    struct gpu_device *device = context->device;
    struct wave_state *state = &context->known_state;
    const struct hit *hits = gpu_buffer_open(device, &context->hits, error);
    uint32_t *list = hits ? gpu_buffer_open(device, &context->hit_list, error) : NULL;
    uint32_t *places = list ? gpu_buffer_open(device, &context->hit_places, error) : NULL;
    if (places)
        context->hit_count = host->list_hits(hits, context->ray_count, list, places);
    if (hits)
        gpu_buffer_unmap(device, &context->hits);
    if (list)
        gpu_buffer_unmap(device, &context->hit_list);
    if (!places)
        return false;
    gpu_buffer_unmap(device, &context->hit_places);
    state->hits = counts_of(context->hit_count);
    state->hit_blocks = counts_of(blocks_of(context->hit_count));
    write_state(context);
    return true;
}

bool compact_hits(struct render_context *context, struct error *error)
{
    const struct host_passes *host = host_of(context);
    if (host)
        return list_hits(host, context, error);
    const struct gpu_program *program = context_use(context, "render/hit_count.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_storage(&context->hits, BIND_HITS);
    gpu_buffer_bind_storage(&context->block_offsets, BIND_BLOCK_OFFSETS);
    compact_dispatch(context, program, WAVE_RAY_BLOCKS);
    program = use_scan(context, true, error);
    if (!program || !scan(context, program, error))
        return false;
    program = context_use(context, "render/hit_list.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_storage(&context->hit_list, BIND_HIT_LIST);
    gpu_buffer_bind_storage(&context->hit_places, BIND_HIT_PLACES);
    compact_dispatch(context, program, WAVE_RAY_BLOCKS);
    context->hit_count = context->counts_on_host ? context->known_state.hits.count : context->ray_count;
    return true;
}

static bool decide_order(struct render_context *context, struct error *error)
{
    const struct gpu_program *program = context_use(context, "render/compact_sample.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_storage(&context->wave_state, BIND_WAVE);
    gpu_dispatch(context->device, program, 1); /* one group */
    return true;
}

static bool write_places(const struct host_passes *host, struct render_context *context,
                         struct gpu_buffer *child_counts, struct error *error)
{
    const uint32_t *counts = gpu_buffer_open(context->device, child_counts, error);
    uint32_t(*offsets)[2] = counts ? gpu_buffer_open(context->device, &context->block_offsets, error) : NULL;
    if (offsets) {
        host->place_children(counts, context->hit_count, context->known_state.sorted != 0, offsets);
        gpu_buffer_unmap(context->device, &context->block_offsets);
    }
    if (counts)
        gpu_buffer_unmap(context->device, child_counts);
    return offsets != NULL;
}

static bool place_children(const struct host_passes *host, struct render_context *context,
                           struct gpu_buffer *child_counts, bool sorts, struct error *error)
{
    struct wave_state *state = &context->known_state;
    const uint32_t *counts = gpu_buffer_open(context->device, child_counts, error);
    uint32_t children, shadow_rays;
    if (!counts)
        return false;
    host->count_children(counts, context->hit_count, &children, &shadow_rays);
    gpu_buffer_unmap(context->device, child_counts);
    if (sorts && children > 0) {
        if (!decide_order(context, error))
            return false;
        gpu_buffer_read(context->device, &context->wave_state, 0, state, sizeof(*state));
    }
    if (children > context->wave_capacity) {
        state->stopped = WAVE_STOPPED_FULL;
        children = 0;
    }
    if (children > 0 && !write_places(host, context, child_counts, error))
        return false;
    state->rays = counts_of(children);
    state->ray_blocks = counts_of(blocks_of(children));
    state->all_secondary_rays += children;
    state->all_shadow_rays += shadow_rays;
    write_state(context);
    context->ray_count = children;
    return gpu_check(context->device, "compacting", error);
}

bool compact_children(struct render_context *context, const struct compact_order *order,
                      struct gpu_buffer *child_counts, struct error *error)
{
    gpu_buffer_bind_storage(child_counts, BIND_CHILD_COUNTS);
    const struct host_passes *host = host_of(context);
    if (host)
        return place_children(host, context, child_counts, order->sorts, error);
    if (order->sorts && !decide_order(context, error))
        return false;
    const struct gpu_program *program = context_use(context, "render/compact_count.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_storage(&context->block_offsets, BIND_BLOCK_OFFSETS);
    compact_dispatch(context, program, WAVE_HIT_BLOCKS);
    program = use_scan(context, false, error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "capacity", context->wave_capacity);
    gpu_uniform_uint(program, "last_queued", order->last_queued);
    if (!scan(context, program, error))
        return false;
    const uint64_t maximum = (uint64_t)context->hit_count * order->children_a_hit;
    context->ray_count = context->counts_on_host            ? context->known_state.rays.count
                         : maximum < context->wave_capacity ? (uint32_t)maximum
                                                            : context->wave_capacity;
    return true;
}

bool compact_shadow_rays(struct render_context *context, uint32_t count, bool all_count, struct wave *wave,
                         struct error *error)
{
    wave->ray_count = context->hit_count * count;
    if (context->counts_on_host) {
        context->shadow_rays += all_count ? wave->ray_count : 0;
        return true;
    }
    const struct gpu_program *program = context_use(context, "render/shadow_count.comp", error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "batch_rays", count);
    gpu_uniform_uint(program, "all_count", all_count);
    gpu_buffer_bind_storage(&context->wave_state, BIND_WAVE);
    gpu_dispatch(context->device, program, 1);
    wave->counts = &context->wave_state;
    wave->counts_index = WAVE_SHADOW_RAYS;
    stop_in(context, wave);
    return true;
}

void compact_rays(struct render_context *context, struct wave *wave)
{
    wave->ray_count = context->ray_count;
    wave->counts = context->counts_on_host ? NULL : &context->wave_state;
    wave->counts_index = WAVE_RAYS;
    stop_in(context, wave);
}

void compact_announce_hits(struct render_context *context)
{
    if (host_of(context))
        return;
    (void)context_use(context, "render/hit_count.comp", NULL);
    (void)use_scan(context, true, NULL);
    (void)context_use(context, "render/hit_list.comp", NULL);
}

void compact_announce_children(struct render_context *context, bool sorts)
{
    if (!context->counts_on_host)
        (void)context_use(context, "render/shadow_count.comp", NULL);
    if (sorts)
        (void)context_use(context, "render/compact_sample.comp", NULL);
    if (host_of(context))
        return;
    (void)context_use(context, "render/compact_count.comp", NULL);
    (void)use_scan(context, false, NULL);
}
