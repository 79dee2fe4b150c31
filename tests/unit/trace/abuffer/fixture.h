/* SPDX-License-Identifier: MIT */
/* A scene, its A-buffers, and what is read back of them, for the tests of the build. */
#ifndef FARLIGHT_TESTS_ABUFFER_FIXTURE_H
#define FARLIGHT_TESTS_ABUFFER_FIXTURE_H

#include "tests/fixtures/waves.h"

#include "abuffer/layout.h"
#include "trace/abuffer/build.h"
#include "trace/raster/draw.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct fixture {
    struct scene *scene;
    struct gpu_scene gpu;
    struct abuffer_builder *builder;
    struct abuffer_store store;
    struct tracer_options options;
    uint32_t *instances, instance_count; /* drawn instances */
};

/* Updates the device to the motion; NULL: to the committed scene. */
static inline void fixture_update(struct fixture *fixture, const struct scene_motion *motion)
{
    struct error error = {0};
    struct scene_changes changes;
    expect_ok(gpu_scene_update(&fixture->gpu, fixture->scene, motion, &changes, NULL, &error), &error);
    free(fixture->instances);
    expect_ok(axes_list_instances(&fixture->gpu, &fixture->instances, &fixture->instance_count, &error), &error);
}

static inline void fixture_init(struct fixture *fixture, struct scene *scene)
{
    struct error error = {0};
    /* A search by parity needs every sample. */
    *fixture = (struct fixture){.scene = scene, .options.abuffer.form = TRACER_FORM_PAPER};
    gpu_scene_init(&fixture->gpu, device);
    fixture_update(fixture, NULL);
    fixture->builder = abuffer_builder_create(device, &error);
    expect_ok(fixture->builder != NULL, &error);
    abuffer_store_init(&fixture->store, device);
}

static inline void fixture_finish(struct fixture *fixture)
{
    abuffer_builder_destroy(fixture->builder);
    abuffer_store_finish(&fixture->store);
    gpu_scene_finish(&fixture->gpu);
    scene_destroy(fixture->scene);
    free(fixture->instances);
}

/* Round all instances. */
static inline void place(struct fixture *fixture, uint32_t resolution, uint32_t voxels_along)
{
    struct abuffer_store *store = &fixture->store;
    float longest = 0;
    for (int k = 0; k < 3; k++)
        longest = fmaxf(longest, fixture->gpu.upper_world[k] - fixture->gpu.lower_world[k]);
    store->resolution = resolution;
    store->voxels_along = voxels_along;
    store->cell_world = longest * 1.001f / (float)resolution;
    for (int k = 0; k < 3; k++)
        store->lower_world[k] = fixture->gpu.lower_world[k] - 0.0005f * longest;
}

/* Builds in one step. */
static inline bool try_build(struct fixture *fixture, struct error *error)
{
    return abuffer_build_begin(fixture->builder, &fixture->store, &fixture->gpu, fixture->instances,
                               fixture->instance_count, &fixture->options, error) &&
           abuffer_build_step(fixture->builder, STEP_WITHOUT_END, error) == TRACER_DONE;
}

static inline void build(struct fixture *fixture, uint32_t resolution, uint32_t voxels_along)
{
    struct error error = {0};
    place(fixture, resolution, voxels_along);
    expect_ok(try_build(fixture, &error), &error);
}

/* A structure, read back. */
struct contents {
    struct abuffer_store store; /* copy from that time */
    uint32_t (*texels)[2];      /* first, count; image after image, row after row */
    uint32_t (*samples)[2];
    uint32_t *ids;
    uint32_t (*drawn)[4];
    int32_t (*sums)[4];
    uint32_t (*subvoxels)[ABUFFER_SUBVOXELS_TEXELS][2]; /* by axes */
};

static inline void *read_all(const struct gpu_buffer *buffer, size_t bytes)
{
    void *data = malloc(bytes + 1);
    assert_in_range(bytes, 0, buffer->size_bytes);
    gpu_buffer_read(device, buffer, 0, data, bytes);
    return data;
}

/* From tiles to rows. What pads tiles is empty. */
static inline void *read_texels(const struct abuffer_store *store)
{
    const uint32_t n = store->resolution, tiles = ABUFFER_TILES_ALONG(n);
    uint32_t(*tiled)[2] = read_all(&store->texels, (size_t)3 * tiles * tiles * ABUFFER_TILE_TEXELS * 8);
    uint32_t(*texels)[2] = malloc((size_t)3 * n * n * 8);
    for (uint32_t axis = 0; axis < 3; axis++)
        for (uint32_t v = 0; v < 8 * tiles; v++)
            for (uint32_t u = 0; u < 8 * tiles; u++) {
                const uint32_t *words = tiled[ABUFFER_TEXEL(tiles, axis, u, v)];
                if (u < n && v < n)
                    memcpy(texels[(axis * n + v) * n + u], words, 8);
                else
                    assert_int_equal(words[1], 0);
            }
    free(tiled);
    return texels;
}

static inline void contents_read(struct contents *contents, const struct abuffer_store *store)
{
    size_t along = store->voxels_along;
    contents->store = *store;
    contents->texels = read_texels(store);
    contents->samples = read_all(&store->samples, store->sample_count * 8);
    contents->ids = read_all(&store->ids, store->sample_count * 4);
    contents->drawn = read_all(&store->drawn, store->drawn_count * 16);
    size_t subvoxels = abuffer_has_subvoxels(store) ? along * along * along : 1;
    contents->subvoxels = read_all(&store->subvoxels, subvoxels * sizeof(*contents->subvoxels));
    contents->sums = read_all(&store->sums, along * along * along * 16);
}

static inline void contents_free(struct contents *contents)
{
    free(contents->texels);
    free(contents->samples);
    free(contents->ids);
    free(contents->drawn);
    free(contents->sums);
    free(contents->subvoxels);
}

static inline uint32_t texel_count_of(const struct contents *contents)
{
    return 3 * contents->store.resolution * contents->store.resolution;
}

static inline float depth_of(const struct contents *contents, uint32_t sample)
{
    float depth;
    memcpy(&depth, &contents->samples[sample][0], sizeof(depth));
    return depth;
}

static inline void normal_of(double out[3], const struct contents *contents, uint32_t sample)
{
    uint32_t bits = contents->samples[sample][1];
    int32_t x = (int32_t)(bits << 20) >> 20, y = (int32_t)(bits << 8) >> 20;
    double p[2] = {x / 2047.0, y / 2047.0}, length = 0;
    out[2] = 1 - fabs(p[0]) - fabs(p[1]);
    out[0] = out[2] < 0 ? (1 - fabs(p[1])) * (p[0] >= 0 ? 1 : -1) : p[0];
    out[1] = out[2] < 0 ? (1 - fabs(p[0])) * (p[1] >= 0 ? 1 : -1) : p[1];
    for (int k = 0; k < 3; k++)
        length += out[k] * out[k];
    for (int k = 0; k < 3; k++)
        out[k] /= sqrt(length);
}

static inline bool bounds_body(const struct contents *contents, uint32_t sample)
{
    return (contents->samples[sample][1] & ABUFFER_SAMPLE_BODY) != 0;
}

static inline int winding_of(const struct contents *contents, uint32_t sample)
{
    return (int)(contents->samples[sample][1] >> ABUFFER_WINDING_SHIFT & ABUFFER_WINDING_MASK) -
           ABUFFER_WINDING_ZERO;
}

/* Entry of `drawn` of a sample. */
static inline const uint32_t *drawn_of(const struct contents *contents, uint32_t sample)
{
    uint32_t last = 0;
    while (last + 1 < contents->store.drawn_count && contents->drawn[last + 1][0] <= contents->ids[sample])
        last++;
    return contents->drawn[last];
}

static inline uint32_t primitive_of(const struct contents *contents, uint32_t sample)
{
    return contents->ids[sample] - drawn_of(contents, sample)[1];
}

/* Runs are the texels' own, all samples are in one, and each is sorted; windings change as samples say. */
static inline void expect_consistent(const struct contents *contents)
{
    const struct abuffer_store *store = &contents->store;
    uint8_t *taken = calloc(store->sample_count + 1, 1);
    uint64_t total = 0, deepest = 0;
    for (uint32_t i = 0; i < texel_count_of(contents); i++) {
        uint32_t first = contents->texels[i][0], count = contents->texels[i][1];
        int before = 0, axis = (int)(i / (store->resolution * store->resolution));
        total += count;
        deepest = count > deepest ? count : deepest;
        assert_true((uint64_t)first + count <= store->sample_count);
        for (uint32_t k = first; k < first + count; k++) {
            double normal[3];
            float depth = depth_of(contents, k);
            assert_false(taken[k]++);
            assert_true(depth >= 0 && depth <= (float)store->resolution);
            if (k > first)
                assert_true(depth > depth_of(contents, k - 1) ||
                            (depth == depth_of(contents, k - 1) && contents->ids[k] >= contents->ids[k - 1]));
            int change = winding_of(contents, k) - before;
            before += change;
            normal_of(normal, contents, k);
            if (!bounds_body(contents, k))
                assert_int_equal(change, 0);
            else if (abs(before) < ABUFFER_WINDING_ZERO - 1) /* beyond, it cannot be told */
                assert_int_equal(abs(change), 1);
            /* Where it can be told from a normal of 24 bits: in where the outside looks back. */
            if (bounds_body(contents, k) && fabs(normal[axis]) > 0.01 && change != 0)
                assert_int_equal(change, normal[axis] < 0 ? 1 : -1);
        }
    }
    assert_int_equal(total, store->sample_count);
    assert_int_equal(deepest, store->depth_max);
    free(taken);
}

static inline void expect_same(const struct contents *a, const struct contents *b)
{
    size_t voxels = (size_t)a->store.voxels_along * a->store.voxels_along * a->store.voxels_along;
    assert_int_equal(a->store.sample_count, b->store.sample_count);
    assert_int_equal(a->store.depth_max, b->store.depth_max);
    for (uint32_t i = 0; i < texel_count_of(a); i++) {
        uint32_t count = a->texels[i][1], first = a->texels[i][0], other = b->texels[i][0];
        assert_int_equal(count, b->texels[i][1]);
        for (uint32_t k = 0; k < count; k++) {
            assert_true(depth_of(a, first + k) == depth_of(b, other + k));
            assert_int_equal(a->samples[first + k][1], b->samples[other + k][1]);
        }
        assert_memory_equal(&a->ids[first], &b->ids[other], 4 * count);
    }
    assert_memory_equal(a->sums, b->sums, 16 * voxels);
    assert_memory_equal(a->subvoxels, b->subvoxels,
                        abuffer_has_subvoxels(&a->store) ? sizeof(*a->subvoxels) * voxels : sizeof(*a->subvoxels));
}

#endif
