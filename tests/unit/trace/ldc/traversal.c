/* SPDX-License-Identifier: MIT */
/* Traversal of layered depth cubes where the contract does not look: the most rounds that a ray takes, what the
 * device has no room for, what the host builds in place of shaders, and hits within a tolerance. */
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
        progress = ldc_levels_go_on(&levels, &error);
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

/* A dispatch must have time for them (trace_rays_a_dispatch). The sheets all pass the same cells. */
TEST(no_ray_takes_more_rounds_than_the_structure_allows)
{
    enum { SHEETS = 40 };
    const float apart = 0.02f * 2 / RESOLUTION;
    struct tracer_options options = {.bench.ldc_count_steps = 1};
    struct fixture fixture;
    fixture_init(&fixture, sheets_scene(SHEETS, apart));
    rays_between_sheets(rays, RAY_COUNT, SHEETS, apart);
    for (options.ldc.levels = LDC_LEVELS_PYRAMID; options.ldc.levels <= LDC_LEVELS_CELLS; options.ldc.levels++) {
        uint32_t tests_max = 0;
        build_all(&fixture, &options);
        trace(&fixture, rays, hits);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const uint64_t rounds = (uint64_t)hits[i].distance + hits[i].primitive;
            if (rounds > ldc_rounds_of_a_ray(&fixture.store))
                fail_msg("levels %u: ray %u takes %llu rounds", options.ldc.levels, i, (unsigned long long)rounds);
            tests_max = hits[i].primitive > tests_max ? hits[i].primitive : tests_max;
        }
        assert_in_range(tests_max, SHEETS * RESOLUTION / 2, UINT32_MAX);
    }
    fixture_finish(&fixture);
}

TEST(where_cells_do_not_fit_a_pyramid_is_traversed)
{
    const uint64_t texels_max = device->facts.texture_buffer_texels_max;
    struct fixture fixture;
    fixture_init(&fixture, test_scene_spheres());
    random_rays(rays);
    build_all(&fixture, &(struct tracer_options){.ldc.levels = LDC_LEVELS_PYRAMID});
    trace(&fixture, rays, expected);
    assert_in_range(hits_in(expected), RAY_COUNT / 8, RAY_COUNT);
    fixture.options = (struct tracer_options){0}; /* of the same samples */
    build_levels(&fixture);
    assert_false(fixture.store.no_cells);
    device->facts.texture_buffer_texels_max = 4ull * fixture.store.cubes[LDC_CUBE_STATIC].entry_count - 1;
    build_levels(&fixture);
    device->facts.texture_buffer_texels_max = texels_max;
    assert_true(fixture.store.no_cells);
    trace(&fixture, rays, hits);
    assert_memory_equal(hits, expected, sizeof(hits));
    build_levels(&fixture);
    assert_false(fixture.store.no_cells);
    fixture_finish(&fixture);
}

TEST_LONG(the_host_and_the_device_make_the_same_cells)
{
    struct scene *(*const scenes[])(void) = {test_scene_soup, test_scene_spheres};
    random_rays(rays);
    for (size_t i = 0; i < sizeof(scenes) / sizeof(scenes[0]); i++) {
        struct fixture fixture;
        fixture_init(&fixture, scenes[i]());
        build_all(&fixture, &(struct tracer_options){.bench.ldc_on_device = 1});
        const uint32_t entry_count = fixture.store.cubes[LDC_CUBE_STATIC].entry_count;
        trace(&fixture, rays, expected);
        assert_in_range(hits_in(expected), RAY_COUNT / 8, RAY_COUNT);
        build_all(&fixture, &(struct tracer_options){0});
        assert_int_equal(fixture.store.cubes[LDC_CUBE_STATIC].entry_count, entry_count);
        trace(&fixture, rays, hits);
        for (uint32_t k = 0; k < RAY_COUNT; k++)
            if (hits[k].distance != expected[k].distance) /* samples may lie at other places */
                fail_msg("scene %zu, ray %u: %.9g for %.9g", i, k, (double)hits[k].distance,
                         (double)expected[k].distance);
        fixture_finish(&fixture);
    }
}

/* The paper's test: a hit is where the ray comes as near to a sample's depth, in its texel. Rays straight down on
 * a slope meet samples' own depths; rays along the slope, half a cell above it, hit within a tolerance of a cell
 * and not within one of a tenth. */
TEST_LONG(a_tolerance_takes_depths_for_planes)
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
    const struct tracer_options nearly_nothing[] = {
        {.ldc.tolerance = 0.0004f}, {.ldc = {.tolerance = 0.0004f, .levels = LDC_LEVELS_BLOCKS, .block = 8}}};
    for (size_t form = 0; form < 2; form++) {
        build_all(&fixture, &nearly_nothing[form]);
        const struct ldc_cube *cube = &fixture.store.cubes[LDC_CUBE_STATIC];
        trace(&fixture, rays, hits);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const float texel = floorf((rays[i].origin_t_min[0] - cube->lower_world[0]) / cube->cell_world);
            const float middle = cube->lower_world[0] + (texel + 0.5f) * cube->cell_world;
            assert_float_equal(3 - hits[i].distance, 0.5f * (middle + 1), 1e-4f);
        }
    }
    const float cell = fixture.store.cubes[LDC_CUBE_STATIC].cell_world;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        rays[i] =
            (struct ray){{-0.9f, test_uniform(&seed, -0.9f, 0.9f), 0.05f + 0.5f * cell, 0}, {1, 0, 0.5f, 1e30f}};
    for (int wide = 0; wide < 2; wide++) {
        build_all(&fixture, &(struct tracer_options){.ldc.tolerance = cell * (wide ? 1.5f : 0.1f)});
        trace(&fixture, rays, hits);
        assert_int_equal(hits_in(hits), wide ? RAY_COUNT : 0);
    }
    fixture_finish(&fixture);
}
