/* SPDX-License-Identifier: MIT */
/* From the fragments of texels to their samples by the host, as ldc/sort.comp and ldc/pack.comp do it on a GPU.
 * Software GL shares its memory with the host, and its compute shaders sort and store lane by lane. */
#include "ldc/layout.h"
#include "trace/ldc/build_state.h"

#include "base/parallel.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* Of a row: texels are written in 12 bits. */
#define TEXELS_MAX 4096u
/* Up to so many fragments are sorted by insertion; more by qsort(). */
#define FEW 32u

struct host_pack {
    const struct ldc_task *task;
    const uint32_t *counts, *places; /* NULL: every fragment has a slot */
    uint32_t (*ordered)[2], (*texels)[4], (*quads)[4], (*surface)[4];
    atomic_uint samples, quad_count, samples_lost;
};

bool ldc_host_is_used(const struct ldc_task *task)
{
    return gpu_host_builds(task->builder->device) && task->slots > 0;
}

/* As ldc/run.glsl has it. */
static uint32_t *fragment_of(const struct host_pack *pack, uint32_t texel, uint32_t i)
{
    const uint32_t slots = pack->task->slots, texel_count = pack->task->texel_count;
    return pack
        ->ordered[i < slots ? i * texel_count + texel : slots * texel_count + pack->places[texel] + (i - slots)];
}

/* In order of depth, then of the primitive: depths are not negative, so that their bits ascend as they do. */
static uint64_t key_of(const uint32_t fragment[2])
{
    return (uint64_t)fragment[0] << 32 | fragment[1];
}

static int compare(const void *a, const void *b)
{
    const uint64_t left = *(const uint64_t *)a, right = *(const uint64_t *)b;
    return (left > right) - (left < right);
}

static void sort(uint64_t *keys, uint32_t count)
{
    if (count > FEW) {
        qsort(keys, count, sizeof(*keys), compare);
        return;
    }
    for (uint32_t i = 1; i < count; i++) {
        const uint64_t moved = keys[i];
        uint32_t k = i;
        for (; k > 0 && moved < keys[k - 1]; k--)
            keys[k] = keys[k - 1];
        keys[k] = moved;
    }
}

/* Sorts a texel's fragments; returns how many of them are kept, which come first: the nearest, of those at the
 * same depth the first one. */
static uint32_t sort_texel(struct host_pack *pack, uint32_t texel)
{
    uint64_t keys[LDC_LISTED_LAYERS_MAX];
    const uint32_t count = pack->counts[texel], layers_max = pack->task->layers_max;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < count; i++)
        keys[i] = key_of(fragment_of(pack, texel, i));
    sort(keys, count);
    for (uint32_t i = 0; i < count && kept < layers_max; i++) {
        if (i > 0 && keys[i] >> 32 == keys[i - 1] >> 32)
            continue;
        uint32_t *fragment = fragment_of(pack, texel, kept++);
        fragment[0] = (uint32_t)(keys[i] >> 32);
        fragment[1] = (uint32_t)keys[i];
    }
    if (kept == layers_max && count > kept)
        atomic_fetch_add(&pack->samples_lost, count - kept);
    return kept;
}

/* Writes a texel with some samples, whose first sample and quad are those of the cube from these on. */
static void emit(struct host_pack *pack, uint32_t texel, uint32_t bits, uint32_t kept, const uint32_t place[2])
{
    const struct ldc_cube *cube = pack->task->cube;
    const uint32_t no_depths[4] = {LDC_NO_DEPTH_BITS, LDC_NO_DEPTH_BITS, LDC_NO_DEPTH_BITS, LDC_NO_DEPTH_BITS};
    uint32_t(*quads)[4] = &pack->quads[cube->first_quad + place[1]],
    (*seen)[4] = &pack->surface[cube->first_sample + place[0]];
    for (uint32_t i = 0; i < kept; i++) {
        const uint32_t *fragment = fragment_of(pack, texel, i);
        const uint32_t words[4] = {bits, fragment[0], fragment[1], 0};
        memcpy(seen[i], words, sizeof(words));
        if (i % 4 == 0)
            memcpy(quads[i / 4], no_depths, sizeof(no_depths));
        quads[i / 4][i % 4] = fragment[0];
    }
    const uint32_t words[4] = {cube->first_sample + place[0],
                               (cube->first_quad + place[1]) << LDC_TEXEL_QUAD_SHIFT | kept, seen[0][1],
                               seen[kept - 1][1]};
    memcpy(pack->texels[cube->first_texel + texel], words, sizeof(words));
}

/* All at once, so that neighbours' samples are neighbours. */
static void do_row(void *context, uint32_t row)
{
    struct host_pack *pack = context;
    static const float no_range[2] = {LDC_NO_DEPTH, -LDC_NO_DEPTH};
    uint32_t empty[4] = {0};
    uint8_t kept[TEXELS_MAX];
    const uint32_t n = pack->task->cube->resolution, bits = row / n << 24 | row % n << 12;
    uint32_t samples = 0, quads = 0;
    memcpy(&empty[2], no_range, sizeof(no_range));
    for (uint32_t u = 0; u < n; u++) {
        kept[u] = (uint8_t)sort_texel(pack, row * n + u);
        samples += kept[u];
        quads += (kept[u] + 3u) / 4;
    }
    uint32_t place[2] = {atomic_fetch_add(&pack->samples, samples), atomic_fetch_add(&pack->quad_count, quads)};
    for (uint32_t u = 0; u < n; u++) {
        if (kept[u] == 0) {
            memcpy(pack->texels[pack->task->cube->first_texel + row * n + u], empty, sizeof(empty));
            continue;
        }
        emit(pack, row * n + u, bits | u, kept[u], place);
        place[0] += kept[u];
        place[1] += (kept[u] + 3u) / 4;
    }
}

/* ---- counts ---- */

static void give_places(uint32_t *places, const uint32_t *counts, const struct ldc_task *task)
{
    uint32_t place = 0;
    for (uint32_t texel = 0; texel < task->texel_count; texel++) {
        places[texel] = place;
        place += counts[texel] > task->slots ? counts[texel] - task->slots : 0;
    }
}

bool ldc_host_give_places(struct ldc_task *task, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    struct ldc_build_counts sums = {0};
    uint64_t fragments = 0;
    const uint32_t *counts = gpu_buffer_open(device, &builder->counts, error);
    if (!counts)
        return false;
    for (uint32_t texel = 0; texel < task->texel_count; texel++) {
        const uint32_t count = counts[texel];
        fragments += count;
        sums.layers_needed = count > sums.layers_needed ? count : sums.layers_needed;
        sums.occupied += count > 0;
        sums.quads_max += (count + 3) / 4;
        sums.places += count > task->slots ? count - task->slots : 0;
    }
    sums.fragments = sums.samples_max = (uint32_t)fragments;
    sums.fragments_wraps = (uint32_t)(fragments >> 32);
    task->counts = sums;
    void *places = NULL;
    bool given = sums.places == 0;
    if (!given &&
        gpu_buffer_reserve(device, &builder->places, (size_t)task->texel_count * sizeof(uint32_t), error))
        places = gpu_buffer_open(device, &builder->places, error);
    if (places) {
        give_places(places, counts, task);
        gpu_buffer_unmap(device, &builder->places);
        given = true;
    }
    gpu_buffer_unmap(device, &builder->counts);
    return given;
}

bool ldc_host_histogram(struct ldc_task *task, uint32_t texels_with[LDC_HISTOGRAM_BINS], struct error *error)
{
    const uint32_t *counts = gpu_buffer_open(task->builder->device, &task->builder->counts, error);
    memset(texels_with, 0, LDC_HISTOGRAM_BINS * sizeof(*texels_with));
    for (uint32_t texel = 0; counts && texel < task->texel_count; texel++)
        texels_with[counts[texel] < LDC_HISTOGRAM_BINS ? counts[texel] : LDC_HISTOGRAM_BINS - 1]++;
    if (counts)
        gpu_buffer_unmap(task->builder->device, &task->builder->counts);
    return counts != NULL;
}

/* ---- samples ---- */

enum { OPENED_BUFFERS = 6 };

static int list_opened(struct ldc_task *task, struct gpu_buffer *buffers[OPENED_BUFFERS])
{
    struct ldc_builder *builder = task->builder;
    struct ldc_store *store = task->store;
    struct gpu_buffer *all[OPENED_BUFFERS] = {&builder->counts, &builder->ordered, &store->texels,
                                              &store->quads,    &store->surface,   &builder->places};
    memcpy(buffers, all, sizeof(all));
    return task->counts.places > 0 ? OPENED_BUFFERS : OPENED_BUFFERS - 1;
}

bool ldc_host_pack(struct ldc_task *task, struct error *error)
{
    struct gpu_buffer *buffers[OPENED_BUFFERS];
    void *opened[OPENED_BUFFERS] = {0};
    if (task->counts.samples_max == 0)
        return true;
    const int count = list_opened(task, buffers);
    if (!gpu_buffers_open(task->builder->device, buffers, count, opened, error))
        return false;
    struct host_pack pack = {.task = task,
                             .counts = opened[0],
                             .ordered = opened[1],
                             .texels = opened[2],
                             .quads = opened[3],
                             .surface = opened[4],
                             .places = opened[5]};
    parallel_run(parallel_processors(), 3 * task->cube->resolution, do_row, &pack);
    task->counts.samples = atomic_load(&pack.samples);
    task->counts.quads = atomic_load(&pack.quad_count);
    task->counts.samples_lost = atomic_load(&pack.samples_lost);
    gpu_buffers_close(task->builder->device, buffers, count);
    return true;
}
