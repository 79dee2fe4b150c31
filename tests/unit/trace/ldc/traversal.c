/* SPDX-License-Identifier: MIT */
/* Traversal of layered depth cubes where the contract does not look: what the device has no room for,
 * what the host builds in place of shaders, and the paper's hits within a tolerance. */
#include "tests/unit/trace/ldc/fixture.h"
#include "tests/unit/trace/stack_scene.h"

#include "tests/harness/test.h"
#include "trace/ldc/levels.h"
#include "trace/ldc/trace.h"

#define RAY_COUNT 4096u
#define RESOLUTION 64u

/* Builds the levels by which rays skip empty space in the static cube. */
static void build_levels(struct fixture *fixture)
{
    struct error error = {0};
    struct ldc_levels levels;
    enum tracer_progress progress = TRACER_MORE;
    ldc_levels_begin(&levels, &fixture->store, LDC_CUBE_STATIC, &fixture->options);
    while (progress == TRACER_MORE)
        progress = ldc_levels_step(&levels, &error);
    ldc_levels_finish(&levels);
    expect_ok(progress == TRACER_DONE, &error);
}

/* Builds the levels and the cube's samples. */
static void build_all(struct fixture *fixture, const struct tracer_options *options)
{
    fixture->options = *options;
    place(fixture, LDC_CUBE_STATIC, RESOLUTION);
    build(fixture, LDC_CUBE_STATIC, fixture->instances, fixture->gpu.instance_count);
    build_levels(fixture);
}

static bool traverse_wave(void *user, const struct wave *wave, struct error *error)
{
    struct fixture *fixture = user;
    const struct ray_range all = {.wave = wave, .end = wave->ray_count};
    gpu_scene_bind(&fixture->gpu);
    return ldc_intersect(&fixture->store, &fixture->gpu, &all, &fixture->options, error);
}

static void trace(struct fixture *fixture, const struct ray *rays, struct hit *hits)
{
    trace_rays(traverse_wave, fixture, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
}

/* From around the scene and from within it. */
static void random_rays(struct ray *rays)
{
    uint64_t seed = 11;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        rays[i] = (struct ray){.direction_t_max[3] = 1e30f};
        for (int k = 0; k < 3; k++) {
            rays[i].origin_t_min[k] = test_uniform(&seed, -4, 4);
            rays[i].direction_t_max[k] = test_uniform(&seed, -2, 2) - rays[i].origin_t_min[k];
        }
    }
}

static uint32_t hits_in(const struct hit *hits)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        count += hits[i].distance >= 0;
    return count;
}

static struct ray rays[RAY_COUNT];
static struct hit hits[RAY_COUNT], expected[RAY_COUNT];

ALL_TESTS(open_device, close_device)

/* Hits in blocks are not verified: a plane may be half a cell off, and along silhouettes it may be hit where
 * the surface is not, or the other way round. */
TEST(where_cells_do_not_fit_blocks_are_traversed)
{
    const uint64_t texels_max = device->facts.texture_buffer_texels_max;
    struct fixture fixture;
    fixture_init(&fixture, test_scene_spheres());
    random_rays(rays);
    build_all(&fixture, &(struct tracer_options){0});
    trace(&fixture, rays, expected);
    assert_in_range(hits_in(expected), RAY_COUNT / 8, RAY_COUNT);
    assert_false(fixture.store.no_cells);
    device->facts.texture_buffer_texels_max = 4ull * fixture.store.cubes[LDC_CUBE_STATIC].entry_count - 1;
    build_levels(&fixture);
    device->facts.texture_buffer_texels_max = texels_max;
    assert_true(fixture.store.no_cells);
    trace(&fixture, rays, hits);
    const float cell = fixture.store.cubes[LDC_CUBE_STATIC].cell_world;
    uint32_t apart = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float *d = rays[i].direction_t_max, length = sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        apart += fabsf(hits[i].distance - expected[i].distance) * length < cell ? 0 : 1;
    }
    print_message("%u of %u rays are apart\n", apart, RAY_COUNT);
    assert_in_range(apart, 0, RAY_COUNT / 10);
    build_levels(&fixture);
    assert_false(fixture.store.no_cells);
    fixture_finish(&fixture);
}

/* The paper's test: a hit is where the ray comes as near to a sample's depth as a cell is wide, in its texel. Rays
 * straight down on a slope meet samples' own depths; of rays along the slope those hit that are half a cell above
 * it, and not those that are two cells above. */
TEST(the_paper_takes_depths_for_planes)
{
    static const float corners[4][3] = {{-1, -1, 0}, {1, -1, 1}, {-1, 1, 0}, {1, 1, 1}};
    static const uint32_t indices[6] = {0, 1, 2, 2, 1, 3};
    struct test_edits edits = {.scene = test_scene_create()};
    struct fixture fixture;
    uint64_t seed = 101;
    test_mesh(&edits, 1, corners, 4, indices, 2);
    test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
    test_commit(&edits);
    fixture_init(&fixture, edits.scene);
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        rays[i] = (struct ray){{test_uniform(&seed, -0.9f, 0.9f), test_uniform(&seed, -0.9f, 0.9f), 3, 0},
                               {0, 0, -1, 1e30f}};
    build_all(&fixture, &(struct tracer_options){.ldc.form = TRACER_FORM_PAPER});
    const struct ldc_cube *cube = &fixture.store.cubes[LDC_CUBE_STATIC];
    const float cell = cube->cell_world;
    trace(&fixture, rays, hits);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float texel = floorf((rays[i].origin_t_min[0] - cube->lower_world[0]) / cell);
        const float middle = cube->lower_world[0] + (texel + 0.5f) * cell;
        assert_float_equal(3 - hits[i].distance, 0.5f * (middle + 1), 1e-4f);
    }
    for (int above = 0; above < 2; above++) {
        const float falls = (4 - (above ? 2 : 0.5f)) * cell / 1.8f;
        for (uint32_t i = 0; i < RAY_COUNT; i++)
            rays[i] = (struct ray){{-0.9f, test_uniform(&seed, -0.9f, 0.9f), 0.05f + 4 * cell, 0},
                                   {1, 0, 0.5f - falls, 1e30f}};
        trace(&fixture, rays, hits);
        assert_int_equal(hits_in(hits), above ? 0 : RAY_COUNT);
    }
    fixture_finish(&fixture);
}
