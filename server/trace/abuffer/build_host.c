/* SPDX-License-Identifier: MIT */
/* From lists to runs by the host, as abuffer/occupied.comp, resolve.comp and sort.comp do it on a GPU. Software GL
 * shares its memory with the host, and in its compute shaders every lane takes all branches and stores one lane
 * after the other. */
#include "trace/abuffer/build_state.h"

#include "base/parallel.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* That one thread does at once. */
#define PART_TILES 16u
/* Up to so many are sorted as they are taken; more by qsort(). */
#define FEW 16u

struct host_runs {
    const uint32_t *heads;
    const struct abuffer_node *nodes;
    uint32_t (*texels)[2], (*samples)[2], *ids, *deep;
    uint32_t first, end; /* of the tiles */
    atomic_uint sample_count, depth_max, deep_count;
};

bool abuffer_host_is_used(const struct abuffer_task *task)
{
    return gpu_host_builds(task->builder->device);
}

/* ---- one list ---- */

static int compare(const void *a, const void *b)
{
    const struct abuffer_node *left = a, *right = b;
    if (left->depth != right->depth) /* not negative: bits ascend as depths do */
        return left->depth < right->depth ? -1 : 1;
    return (left->id > right->id) - (left->id < right->id);
}

/* As abuffer/run.glsl has it. */
static uint32_t sample_bits(uint32_t bits, int64_t winding)
{
    int64_t stored = winding + ABUFFER_WINDING_ZERO, maximum = ABUFFER_WINDING_MASK;
    stored = stored < 0 ? 0 : stored > maximum ? maximum : stored;
    return (bits & ABUFFER_NODE_NORMAL) | (uint32_t)stored << ABUFFER_WINDING_SHIFT |
           (bits & ABUFFER_NODE_CLOSED ? ABUFFER_SAMPLE_BODY : 0);
}

uint32_t abuffer_host_sort(const struct abuffer_node *nodes, uint32_t head, struct abuffer_node *sorted,
                           uint32_t (*samples)[2], uint32_t *ids)
{
    uint32_t count = 0;
    int64_t winding = 0;
    for (; head != 0; head = nodes[head - 1].next) {
        uint32_t at = count++;
        for (; count <= FEW && at > 0 && compare(&nodes[head - 1], &sorted[at - 1]) < 0; at--)
            sorted[at] = sorted[at - 1];
        sorted[at] = nodes[head - 1];
    }
    if (count > FEW)
        qsort(sorted, count, sizeof(*sorted), compare);
    for (uint32_t i = 0; i < count; i++) {
        const struct abuffer_node *node = &sorted[i];
        if (node->bits & ABUFFER_NODE_CLOSED)
            winding += node->bits & ABUFFER_NODE_LEAVES ? -1 : 1;
        samples[i][0] = node->depth;
        samples[i][1] = sample_bits(node->bits, winding);
        ids[i] = node->id;
    }
    return count;
}

static uint32_t length_of(const struct host_runs *runs, uint32_t head)
{
    uint32_t count = 0;
    for (; head != 0; head = runs->nodes[head - 1].next)
        count++;
    return count;
}

/* ---- many ---- */

static void raise_to(atomic_uint *maximum, uint32_t value)
{
    uint32_t before = atomic_load(maximum);
    while (before < value && !atomic_compare_exchange_weak(maximum, &before, value))
        ;
}

/* Gives the texels of a tile their numbers of samples, of those that are not deep; returns the sum. */
static uint32_t count_tile(struct host_runs *runs, uint32_t number)
{
    const uint32_t first = number * ABUFFER_TILE_TEXELS, *heads = &runs->heads[first];
    uint32_t sum = 0, longest = 0, filled = 0;
    memset(runs->texels[first], 0, ABUFFER_TILE_TEXELS * sizeof(*runs->texels));
    for (uint32_t i = 0; i < ABUFFER_TILE_TEXELS; i++) {
        filled |= heads[i];
        __builtin_prefetch(&runs->nodes[heads[i] > 0 ? heads[i] - 1 : 0]);
    }
    if (filled == 0)
        return 0;
    for (uint32_t i = 0; i < ABUFFER_TILE_TEXELS; i++) {
        const uint32_t count = length_of(runs, heads[i]);
        if (count > ABUFFER_LIST_MAX) {
            runs->deep[atomic_fetch_add(&runs->deep_count, 1)] = first + i;
            continue;
        }
        runs->texels[first + i][1] = count;
        longest = count > longest ? count : longest;
        sum += count;
    }
    raise_to(&runs->depth_max, longest);
    return sum;
}

static void do_part(void *context, uint32_t i)
{
    struct host_runs *runs = context;
    struct abuffer_node sorted[ABUFFER_LIST_MAX];
    const uint32_t first = runs->first + i * PART_TILES, left = runs->end - first;
    const uint32_t end = first + (left < PART_TILES ? left : PART_TILES);
    uint32_t sum = 0;
    for (uint32_t tile = first; tile < end; tile++)
        sum += count_tile(runs, tile);
    uint32_t place = atomic_fetch_add(&runs->sample_count, sum);
    for (uint32_t texel = first * ABUFFER_TILE_TEXELS; sum > 0 && texel < end * ABUFFER_TILE_TEXELS; texel++)
        if (runs->texels[texel][1] > 0) {
            runs->texels[texel][0] = place;
            place += abuffer_host_sort(runs->nodes, runs->heads[texel], sorted, &runs->samples[place],
                                       &runs->ids[place]);
        }
}

/* ---- buffers ---- */

enum { OPENED_BUFFERS = 6 };

static void list_opened(struct abuffer_task *task, struct gpu_buffer *buffers[OPENED_BUFFERS])
{
    struct abuffer_builder *builder = task->builder;
    struct abuffer_store *store = task->store;
    struct gpu_buffer *all[OPENED_BUFFERS] = {&builder->heads, &builder->nodes, &store->texels,
                                              &store->samples, &store->ids,     &builder->deep};
    memcpy(buffers, all, sizeof(all));
}

bool abuffer_host_runs(struct abuffer_task *task, uint32_t first, uint32_t end, struct error *error)
{
    struct gpu_buffer *buffers[OPENED_BUFFERS];
    void *opened[OPENED_BUFFERS] = {0};
    struct abuffer_build_counts *counts = &task->counts;
    list_opened(task, buffers);
    if (!gpu_buffers_open(task->builder->device, buffers, OPENED_BUFFERS, opened, error))
        return false;
    struct host_runs runs = {.heads = opened[0],
                             .nodes = opened[1],
                             .texels = opened[2],
                             .samples = opened[3],
                             .ids = opened[4],
                             .deep = opened[5],
                             .first = first,
                             .end = end};
    atomic_init(&runs.sample_count, counts->samples);
    atomic_init(&runs.depth_max, counts->depth_max);
    atomic_init(&runs.deep_count, counts->deep);
    parallel_run(parallel_processors(), (end - first + PART_TILES - 1) / PART_TILES, do_part, &runs);
    counts->samples = atomic_load(&runs.sample_count);
    counts->depth_max = atomic_load(&runs.depth_max);
    counts->deep = atomic_load(&runs.deep_count);
    gpu_buffers_close(task->builder->device, buffers, OPENED_BUFFERS);
    return true;
}
