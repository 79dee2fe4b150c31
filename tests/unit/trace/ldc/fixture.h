/* SPDX-License-Identifier: MIT */
/* A scene, cubes of it, and what is read back of them, for the tests of the build of layered depth cubes. */
#ifndef FARLIGHT_TESTS_LDC_FIXTURE_H
#define FARLIGHT_TESTS_LDC_FIXTURE_H

#include "tests/fixtures/waves.h"

#include "ldc/layout.h"
#include "shared/surface_sample.h"
#include "trace/ldc/build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A scene and cubes of it. */
struct fixture {
    struct scene *scene;
    struct gpu_scene gpu;
    struct ldc_builder *builder;
    struct ldc_store store;
    struct tracer_options options;
    uint32_t *instances; /* 0, 1, 2, .. */
};

/* Updates the device to the motion; NULL: to the committed scene. */
static inline void fixture_update(struct fixture *fixture, const struct scene_motion *motion)
{
    struct error error = {0};
    struct scene_changes changes;
    expect_ok(gpu_scene_update(&fixture->gpu, fixture->scene, motion, &changes, NULL, &error), &error);
}

static inline void fixture_init(struct fixture *fixture, struct scene *scene)
{
    struct error error = {0};
    *fixture = (struct fixture){.scene = scene};
    gpu_scene_init(&fixture->gpu, device);
    fixture_update(fixture, NULL);
    fixture->builder = ldc_builder_create(device, &error);
    expect_ok(fixture->builder != NULL, &error);
    ldc_store_init(&fixture->store, device);
    fixture->instances = malloc((fixture->gpu.instance_count + 1) * sizeof(uint32_t));
    for (uint32_t i = 0; i < fixture->gpu.instance_count; i++)
        fixture->instances[i] = i;
}

static inline void fixture_finish(struct fixture *fixture)
{
    ldc_builder_destroy(fixture->builder);
    ldc_store_finish(&fixture->store);
    gpu_scene_finish(&fixture->gpu);
    scene_destroy(fixture->scene);
    free(fixture->instances);
}

/* A cube round all instances. */
static inline void place(struct fixture *fixture, unsigned which, uint32_t resolution)
{
    struct ldc_cube *cube = &fixture->store.cubes[which];
    float longest = 0;
    for (int k = 0; k < 3; k++)
        longest = fmaxf(longest, fixture->gpu.upper_world[k] - fixture->gpu.lower_world[k]);
    cube->resolution = resolution;
    cube->cell_world = longest * 1.001f / (float)resolution;
    for (int k = 0; k < 3; k++)
        cube->lower_world[k] = fixture->gpu.lower_world[k] - 0.0005f * longest;
}

/* Builds in one step. */
static inline bool try_build(struct fixture *fixture, unsigned which, const uint32_t *instances, uint32_t count,
                             struct error *error)
{
    gpu_scene_bind(&fixture->gpu);
    enum tracer_progress progress = ldc_build_begin(fixture->builder, &fixture->store, which, &fixture->gpu,
                                                    instances, count, &fixture->options, error);
    while (progress == TRACER_MORE)
        progress = ldc_build_step(fixture->builder, true, error);
    return progress == TRACER_DONE;
}

static inline void build(struct fixture *fixture, unsigned which, const uint32_t *instances, uint32_t count)
{
    struct error error = {0};
    expect_ok(try_build(fixture, which, instances, count, &error), &error);
}

/* A cube, read back. */
struct contents {
    struct ldc_cube cube; /* copy from that time */
    uint32_t (*texels)[4];
    float *quads;
    uint32_t (*geometry)[2];
    uint32_t (*surface)[4];
};

static inline void *read_part(const struct gpu_buffer *buffer, size_t item_bytes, uint32_t first, uint32_t count)
{
    void *data = malloc(count * item_bytes + 1);
    assert_in_range(first * item_bytes + count * item_bytes, 0, buffer->size_bytes);
    gpu_buffer_read(device, buffer, first * item_bytes, data, count * item_bytes);
    return data;
}

static inline void contents_read(struct contents *contents, const struct ldc_store *store, unsigned which)
{
    const struct ldc_cube *cube = &store->cubes[which];
    contents->cube = *cube;
    contents->texels = read_part(&store->texels, 16, cube->first_texel, 3 * cube->resolution * cube->resolution);
    contents->quads = read_part(&store->quads, 16, cube->first_quad, cube->quad_count);
    contents->geometry = read_part(&store->geometry, 8, cube->first_sample, cube->sample_count);
    contents->surface = read_part(&store->surface, 16, cube->first_sample, cube->sample_count);
}

static inline void contents_free(struct contents *contents)
{
    free(contents->texels);
    free(contents->quads);
    free(contents->geometry);
    free(contents->surface);
}

static inline float float_of(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof(value));
    return value;
}

static inline void unpack_unit(double out[3], uint32_t bits)
{
    double x = (double)(int16_t)(bits & 0xffff) / 32767, y = (double)(int16_t)(bits >> 16) / 32767;
    out[2] = 1 - fabs(x) - fabs(y);
    out[0] = out[2] < 0 ? (1 - fabs(y)) * (x >= 0 ? 1.0 : -1.0) : x;
    out[1] = out[2] < 0 ? (1 - fabs(x)) * (y >= 0 ? 1.0 : -1.0) : y;
    double length = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (int k = 0; k < 3; k++)
        out[k] /= length;
}

static inline uint32_t count_of(const struct contents *contents, uint32_t texel)
{
    return contents->texels[texel][1] & LDC_TEXEL_COUNT_MASK;
}

static inline uint32_t sample_of(const struct contents *contents, uint32_t texel)
{
    return contents->texels[texel][0] - contents->cube.first_sample;
}

/* Repeated statements about a texel agree, and its samples are its own. */
static inline void expect_consistent(const struct contents *contents)
{
    const struct ldc_cube *cube = &contents->cube;
    uint8_t *taken = calloc(cube->sample_count + 1, 1);
    uint32_t total = 0;
    for (uint32_t i = 0; i < 3 * cube->resolution * cube->resolution; i++) {
        uint32_t count = count_of(contents, i);
        float minimum = float_of(contents->texels[i][2]), maximum = float_of(contents->texels[i][3]);
        total += count;
        if (count == 0) {
            assert_true(minimum == LDC_NO_DEPTH && maximum == -LDC_NO_DEPTH);
            continue;
        }
        uint32_t first = sample_of(contents, i);
        uint32_t quad = (contents->texels[i][1] >> LDC_TEXEL_QUAD_SHIFT) - cube->first_quad;
        assert_in_range(first + count, 1, cube->sample_count);
        assert_in_range(quad + (count + 3) / 4, 1, cube->quad_count);
        for (uint32_t k = 0; k < (count + 3) / 4 * 4; k++) {
            float depth = contents->quads[4 * quad + k];
            if (k >= count) {
                assert_true(depth == LDC_NO_DEPTH);
                continue;
            }
            assert_true(depth >= 0 && depth <= (float)cube->resolution);
            assert_true(depth == float_of(contents->geometry[first + k][0]));
            assert_true(k == 0 || depth > contents->quads[4 * quad + k - 1]);
            assert_false(taken[first + k]++);
        }
        assert_true(minimum == contents->quads[4 * quad] && maximum == contents->quads[4 * quad + count - 1]);
    }
    assert_int_equal(total, cube->sample_count);
    free(taken);
}

static inline void expect_same(const struct contents *a, const struct contents *b)
{
    assert_int_equal(a->cube.sample_count, b->cube.sample_count);
    assert_int_equal(a->cube.quad_count, b->cube.quad_count);
    assert_int_equal(a->cube.layers_needed, b->cube.layers_needed);
    assert_int_equal(a->cube.layers_kept, b->cube.layers_kept);
    assert_int_equal(a->cube.samples_lost, b->cube.samples_lost);
    for (uint32_t i = 0; i < 3 * a->cube.resolution * a->cube.resolution; i++) {
        uint32_t count = count_of(a, i);
        assert_int_equal(count, count_of(b, i));
        if (count == 0)
            continue;
        assert_memory_equal(&a->texels[i][2], &b->texels[i][2], 8);
        assert_memory_equal(a->geometry[sample_of(a, i)], b->geometry[sample_of(b, i)], 8 * count);
        assert_memory_equal(a->surface[sample_of(a, i)], b->surface[sample_of(b, i)], 16 * count);
    }
}

#endif
