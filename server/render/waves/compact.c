/* SPDX-License-Identifier: MIT */
/* Compacts waves: lists of hits, and the places of children. */
#include "render/waves/compact.h"

#include "host_passes/host_passes.h"
#include "shared/bindings.h"
#include "shared/path.h"

#include <stddef.h>

static uint32_t blocks_of(uint32_t item_count)
{
    return (item_count + COMPACT_BLOCK - 1) / COMPACT_BLOCK;
}

/* Counts as the device does. */
static struct wave_counts counts_of(uint32_t count)
{
    const uint32_t groups = (count + 63) / 64, x = groups < WAVE_GROUPS_MAX ? groups : WAVE_GROUPS_MAX;
    return (struct wave_counts){count, x, x > 0 ? (groups + x - 1) / x : 1, 1};
}

void compact_begin(struct render_wave *wave)
{
    struct wave_state *state = &wave->known_state;
    wave->shadow_rays = 0;
    *state = (struct wave_state){.rays = counts_of(wave->ray_count),
                                 .ray_blocks = counts_of(blocks_of(wave->ray_count))};
    /* Writes all but the outcomes of slices in flight. */
    gpu_buffer_write(wave->device->gpu, &wave->state, 0, state, offsetof(struct wave_state, stopped));
}

void compact_repeat(struct render_wave *wave)
{
    const uint32_t nothing = 0;
    gpu_buffer_write(wave->device->gpu, &wave->state, offsetof(struct wave_state, stopped), &nothing,
                     sizeof(nothing));
}

static void stop_in(struct render_wave *wave, struct wave *rays)
{
    rays->stopped = rays->counts ? &wave->state : NULL;
    rays->stopped_word = offsetof(struct wave_state, stopped) / sizeof(uint32_t);
}

/* Without counts_on_host: the maximum. */
static uint32_t count_of(const struct render_wave *wave, enum wave_list list)
{
    switch (list) {
    case WAVE_RAYS:
        return wave->ray_count;
    case WAVE_RAY_BLOCKS:
        return blocks_of(wave->ray_count);
    case WAVE_HITS:
        return wave->hit_count;
    case WAVE_HIT_BLOCKS:
        return blocks_of(wave->hit_count);
    case WAVE_SHADOW_RAYS:
        break;
    }
    return 0;
}

void compact_dispatch(struct render_wave *wave, const struct gpu_program *program, enum wave_list list)
{
    gpu_buffer_bind_uniform(&wave->state, UNIFORM_WAVE);
    if (wave->device->counts_on_host)
        gpu_dispatch(wave->device->gpu, program, count_of(wave, list));
    else
        gpu_dispatch_indirect(program, &wave->state,
                              list * sizeof(struct wave_counts) + offsetof(struct wave_counts, groups_x));
}

/* In use. `hits`: of rays, else of hits. */
static const struct gpu_program *use_scan(struct render_wave *wave, bool hits, struct error *error)
{
    static const struct gpu_define of_hits[] = {{"HITS", "1"}, {NULL, NULL}};
    return context_use_with(wave->device, "render/compact_scan.comp", hits ? of_hits : NULL, error);
}

/* The blocks' counts become places, and their sum the wave's. `program` is in use. */
static bool scan(struct render_wave *wave, const struct gpu_program *program, struct error *error)
{
    gpu_buffer_bind_storage(&wave->block_offsets, BIND_BLOCK_OFFSETS);
    gpu_buffer_bind_storage(&wave->state, BIND_WAVE);
    gpu_dispatch(wave->device->gpu, program, 1); /* a single group */
    if (wave->device->counts_on_host)
        gpu_buffer_read(wave->device->gpu, &wave->state, 0, &wave->known_state, sizeof(wave->known_state));
    return gpu_check(wave->device->gpu, "compacting", error);
}

/* Writes the state as the scans do. */
static void write_state(struct render_wave *wave)
{
    gpu_buffer_write(wave->device->gpu, &wave->state, 0, &wave->known_state, sizeof(wave->known_state));
}

/* Passes by the host, which has to know the counts. */
static const struct host_passes *host_of(const struct render_wave *wave)
{
    return wave->device->counts_on_host ? host_passes_of(wave->device->gpu) : NULL;
}

static bool list_hits(const struct host_passes *host, struct render_wave *wave, struct error *error)
{
    struct gpu_device *device = wave->device->gpu;
    struct wave_state *state = &wave->known_state;
    const struct hit *hits = gpu_buffer_open(device, &wave->hits, error);
    uint32_t *list = hits ? gpu_buffer_open(device, &wave->hit_list, error) : NULL;
    uint32_t *places = list ? gpu_buffer_open(device, &wave->hit_places, error) : NULL;
    if (places)
        wave->hit_count = host->list_hits(hits, wave->ray_count, list, places);
    if (hits)
        gpu_buffer_unmap(device, &wave->hits);
    if (list)
        gpu_buffer_unmap(device, &wave->hit_list);
    if (!places)
        return false;
    gpu_buffer_unmap(device, &wave->hit_places);
    state->hits = counts_of(wave->hit_count);
    state->hit_blocks = counts_of(blocks_of(wave->hit_count));
    write_state(wave);
    return true;
}

bool compact_hits(struct render_wave *wave, struct error *error)
{
    const struct host_passes *host = host_of(wave);
    if (host)
        return list_hits(host, wave, error);
    const struct gpu_program *program = context_use(wave->device, "render/hit_count.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_storage(&wave->hits, BIND_HITS);
    gpu_buffer_bind_storage(&wave->block_offsets, BIND_BLOCK_OFFSETS);
    compact_dispatch(wave, program, WAVE_RAY_BLOCKS);
    program = use_scan(wave, true, error);
    if (!program || !scan(wave, program, error))
        return false;
    program = context_use(wave->device, "render/hit_list.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_storage(&wave->hit_list, BIND_HIT_LIST);
    gpu_buffer_bind_storage(&wave->hit_places, BIND_HIT_PLACES);
    compact_dispatch(wave, program, WAVE_RAY_BLOCKS);
    wave->hit_count = wave->device->counts_on_host ? wave->known_state.hits.count : wave->ray_count;
    return true;
}

static bool decide_order(struct render_wave *wave, struct error *error)
{
    const struct gpu_program *program = context_use(wave->device, "render/compact_sample.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_storage(&wave->state, BIND_WAVE);
    gpu_dispatch(wave->device->gpu, program, 1); /* a single group */
    return true;
}

static bool write_places(const struct host_passes *host, struct render_wave *wave, struct gpu_buffer *child_counts,
                         struct error *error)
{
    const uint32_t *counts = gpu_buffer_open(wave->device->gpu, child_counts, error);
    uint32_t(*offsets)[2] = counts ? gpu_buffer_open(wave->device->gpu, &wave->block_offsets, error) : NULL;
    if (offsets) {
        host->place_children(counts, wave->hit_count, wave->known_state.sorted != 0, offsets);
        gpu_buffer_unmap(wave->device->gpu, &wave->block_offsets);
    }
    if (counts)
        gpu_buffer_unmap(wave->device->gpu, child_counts);
    return offsets != NULL;
}

static bool place_children(const struct host_passes *host, struct render_wave *wave,
                           struct gpu_buffer *child_counts, bool sorts, struct error *error)
{
    struct wave_state *state = &wave->known_state;
    const uint32_t *counts = gpu_buffer_open(wave->device->gpu, child_counts, error);
    uint32_t children, shadow_rays;
    if (!counts)
        return false;
    host->count_children(counts, wave->hit_count, &children, &shadow_rays);
    gpu_buffer_unmap(wave->device->gpu, child_counts);
    if (sorts && children > 0) {
        if (!decide_order(wave, error))
            return false;
        gpu_buffer_read(wave->device->gpu, &wave->state, 0, state, sizeof(*state));
    }
    if (children > wave->capacity) {
        state->stopped = WAVE_STOPPED_FULL;
        children = 0;
    }
    if (children > 0 && !write_places(host, wave, child_counts, error))
        return false;
    state->rays = counts_of(children);
    state->ray_blocks = counts_of(blocks_of(children));
    state->all_secondary_rays += children;
    state->all_shadow_rays += shadow_rays;
    write_state(wave);
    wave->ray_count = children;
    return gpu_check(wave->device->gpu, "compacting", error);
}

bool compact_children(struct render_wave *wave, const struct compact_order *order, struct gpu_buffer *child_counts,
                      struct error *error)
{
    gpu_buffer_bind_storage(child_counts, BIND_CHILD_COUNTS);
    const struct host_passes *host = host_of(wave);
    if (host)
        return place_children(host, wave, child_counts, order->sorts, error);
    if (order->sorts && !decide_order(wave, error))
        return false;
    const struct gpu_program *program = context_use(wave->device, "render/compact_count.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_storage(&wave->block_offsets, BIND_BLOCK_OFFSETS);
    compact_dispatch(wave, program, WAVE_HIT_BLOCKS);
    program = use_scan(wave, false, error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "capacity", wave->capacity);
    gpu_uniform_uint(program, "last_queued", order->last_queued);
    if (!scan(wave, program, error))
        return false;
    const uint64_t maximum = (uint64_t)wave->hit_count * order->children_a_hit;
    wave->ray_count = wave->device->counts_on_host ? wave->known_state.rays.count
                      : maximum < wave->capacity   ? (uint32_t)maximum
                                                   : wave->capacity;
    return true;
}

bool compact_shadow_rays(struct render_wave *wave, uint32_t count, bool all_count, struct wave *rays,
                         struct error *error)
{
    rays->ray_count = wave->hit_count * count;
    if (wave->device->counts_on_host) {
        wave->shadow_rays += all_count ? rays->ray_count : 0;
        return true;
    }
    const struct gpu_program *program = context_use(wave->device, "render/shadow_count.comp", error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "batch_rays", count);
    gpu_uniform_uint(program, "all_count", all_count);
    gpu_buffer_bind_storage(&wave->state, BIND_WAVE);
    gpu_dispatch(wave->device->gpu, program, 1);
    rays->counts = &wave->state;
    rays->counts_index = WAVE_SHADOW_RAYS;
    stop_in(wave, rays);
    return true;
}

void compact_rays(struct render_wave *wave, struct wave *rays)
{
    rays->ray_count = wave->ray_count;
    rays->counts = wave->device->counts_on_host ? NULL : &wave->state;
    rays->counts_index = WAVE_RAYS;
    stop_in(wave, rays);
}

void compact_announce_hits(struct render_wave *wave)
{
    if (host_of(wave))
        return;
    (void)context_use(wave->device, "render/hit_count.comp", NULL);
    (void)use_scan(wave, true, NULL);
    (void)context_use(wave->device, "render/hit_list.comp", NULL);
}

void compact_announce_children(struct render_wave *wave, bool sorts)
{
    if (!wave->device->counts_on_host)
        (void)context_use(wave->device, "render/shadow_count.comp", NULL);
    if (sorts)
        (void)context_use(wave->device, "render/compact_sample.comp", NULL);
    if (host_of(wave))
        return;
    (void)context_use(wave->device, "render/compact_count.comp", NULL);
    (void)use_scan(wave, false, NULL);
}
