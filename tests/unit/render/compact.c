/* SPDX-License-Identifier: MIT */
/* The host's compaction leaves what the shaders' leaves, byte by byte. */
#include "render/waves/compact.h"
#include "shared/hit.h"
#include "shared/path.h"

#include "tests/fixtures/waves.h"
#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <stdlib.h>
#include <string.h>

#define RAYS_MAX 5000u
#define BLOCKS_MAX ((RAYS_MAX + COMPACT_BLOCK - 1) / COMPACT_BLOCK)

ALL_TESTS(open_device, close_device)

static void reserve(struct gpu_buffer *buffer, size_t bytes)
{
    struct error error = {0};
    expect_ok(gpu_buffer_reserve(device, buffer, bytes, &error), &error);
    gpu_buffer_clear(device, buffer, 0);
}

/* A wave with what the compaction uses of its frame. */
struct compacted {
    struct render_device device;
    struct render_frame frame;
    struct render_wave wave;
};

static void begin(struct compacted *compacted, uint32_t ray_count)
{
    *compacted = (struct compacted){
        .device = {.gpu = device, .counts_on_host = true},
        .frame = {.device = &compacted->device},
        .wave = {.device = &compacted->device,
                 .frame = &compacted->frame,
                 .ray_count = ray_count,
                 .capacity = 8 * RAYS_MAX},
    };
    struct render_wave *wave = &compacted->wave;
    reserve(&wave->hits, RAYS_MAX * sizeof(struct hit));
    reserve(&wave->hit_list, (RAYS_MAX + 1) * sizeof(uint32_t));
    reserve(&wave->hit_places, RAYS_MAX * sizeof(uint32_t));
    reserve(&wave->block_offsets, OCTANTS * BLOCKS_MAX * sizeof(uint32_t[2]));
    reserve(&wave->state, sizeof(struct wave_state));
}

static void finish(struct render_wave *wave)
{
    struct gpu_buffer *buffers[] = {&wave->hits, &wave->hit_list, &wave->hit_places, &wave->block_offsets,
                                    &wave->state};
    for (size_t i = 0; i < sizeof(buffers) / sizeof(buffers[0]); i++)
        gpu_buffer_finish(device, buffers[i]);
}

static void expect_same(const struct gpu_buffer *a, const struct gpu_buffer *b, size_t count, size_t each)
{
    uint8_t *of_a = malloc(count * each), *of_b = malloc(count * each);
    gpu_buffer_read(device, a, 0, of_a, count * each);
    gpu_buffer_read(device, b, 0, of_b, count * each);
    assert_memory_equal(of_a, of_b, count * each);
    free(of_a);
    free(of_b);
}

/* Both the host's and the device's way of two waves that hold the same. */
static void compact_by(bool host, struct render_wave *wave, struct gpu_buffer *child_counts, bool sorts)
{
    const struct gpu_facts facts = device->facts;
    const struct compact_order order = {.children_a_hit = 4, .sorts = sorts};
    struct error error = {0};
    device->facts.shares_memory = host && facts.shares_memory;
    compact_begin(wave);
    expect_ok(compact_hits(wave, &error) && compact_children(wave, &order, child_counts, &error), &error);
    device->facts = facts;
}

/* Waves are sorted by integrators whose hits have one child. */
static void expect_same_compaction(uint32_t ray_count, float hit_share, uint32_t octants, bool sorts)
{
    struct compacted compacted[2];
    struct gpu_buffer child_counts = {0};
    struct hit *hits = calloc(RAYS_MAX, sizeof(*hits));
    uint32_t *counts = calloc(RAYS_MAX, sizeof(*counts));
    uint64_t seed = 7 + ray_count;
    for (uint32_t i = 0; i < RAYS_MAX; i++) {
        hits[i].distance = test_uniform(&seed, 0, 1) < hit_share ? 1.0f : -1.0f;
        const uint32_t children = (uint32_t)test_uniform(&seed, 0, sorts ? 1.99f : 4.99f),
                       octant = (uint32_t)test_uniform(&seed, 0, (float)octants * 0.999f);
        counts[i] = children | octant << CHILD_OCTANT_SHIFT | (i % 3) << SHADOW_RAYS_SHIFT;
    }
    reserve(&child_counts, RAYS_MAX * sizeof(*counts));
    gpu_buffer_write(device, &child_counts, 0, counts, RAYS_MAX * sizeof(*counts));
    for (int i = 0; i < 2; i++) {
        begin(&compacted[i], ray_count);
        gpu_buffer_write(device, &compacted[i].wave.hits, 0, hits, RAYS_MAX * sizeof(*hits));
        compact_by(i == 0, &compacted[i].wave, &child_counts, sorts);
    }
    const struct render_wave *host = &compacted[0].wave, *shaders = &compacted[1].wave;
    assert_int_equal(host->hit_count, shaders->hit_count);
    assert_int_equal(host->ray_count, shaders->ray_count);
    expect_same(&host->hit_list, &shaders->hit_list, host->hit_count, sizeof(uint32_t));
    expect_same(&host->hit_places, &shaders->hit_places, ray_count, sizeof(uint32_t));
    expect_same(&host->state, &shaders->state, 1, sizeof(struct wave_state));
    const uint32_t blocks = (host->hit_count + COMPACT_BLOCK - 1) / COMPACT_BLOCK;
    uint32_t offsets[2][OCTANTS * BLOCKS_MAX][2];
    for (int i = 0; i < 2; i++)
        gpu_buffer_read(device, &compacted[i].wave.block_offsets, 0, offsets[i], sizeof(offsets[i]));
    for (uint32_t k = 0; host->ray_count > 0 && k < blocks * (host->known_state.sorted ? OCTANTS : 1); k++)
        assert_int_equal(offsets[0][k][0], offsets[1][k][0]); /* the other number is of the scan alone */
    for (int i = 0; i < 2; i++)
        finish(&compacted[i].wave);
    gpu_buffer_finish(device, &child_counts);
    free(counts);
    free(hits);
}

TEST(the_host_lists_hits_and_places_children_as_the_shaders_do)
{
    static const uint32_t rays[] = {1, COMPACT_BLOCK, COMPACT_BLOCK + 1, 777, RAYS_MAX};
    if (!device->facts.shares_memory) {
        printf("skipped: this device's buffers are no memory of the host\n");
        skip();
    }
    for (size_t i = 0; i < sizeof(rays) / sizeof(rays[0]); i++) {
        expect_same_compaction(rays[i], 0.6f, OCTANTS, false);
        expect_same_compaction(rays[i], 0.6f, OCTANTS, true);
        expect_same_compaction(rays[i], 1.0f, 2, true);
        expect_same_compaction(rays[i], 0.0f, OCTANTS, true);
    }
}
