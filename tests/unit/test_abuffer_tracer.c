/* SPDX-License-Identifier: MIT */
/* What the tracer `abuffer` promises beside its answers: it is built when what it holds has changed and at no
 * other time, says how large it is, and is at hand again after a failure. */
#include "abuffer_scenes.h"

#include "gpu/device.h"
#include "shared/hit.h"
#include "shared/ray.h"
#include "trace/scene_gpu.h"
#include "trace/tracer.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define RESOLUTION 64u
#define MARGIN_CELLS 2u /* of the resolution, no part of the scene: one on either side */
#define NUMBER_ABUFFER 4

static struct gpu_device *device;
static const struct tracer_options small = {.abuffer_resolution = RESOLUTION};

struct fixture {
    struct scene *scene;
    struct scene_gpu gpu;
    struct test_edits edits;
    struct tracer *tracer;
    struct stage_times times; /* of the last update */
    struct scene_motion motion;
    uint64_t memory_before_bytes; /* of the device */
};

static void expect_ok(bool ok, const struct error *error)
{
    if (!ok)
        fail_msg("%s: %s", error->field, error->text);
}

static bool try_update(struct fixture *fixture, struct error *error)
{
    struct scene_changes changes;
    if (fixture->edits.count > 0)
        test_commit(&fixture->edits);
    const struct scene_motion *motion = fixture->motion.pose_count ? &fixture->motion : NULL;
    expect_ok(scene_gpu_update(&fixture->gpu, fixture->scene, motion, &changes, NULL, error), error);
    stage_times_begin(&fixture->times);
    return tracer_update(fixture->tracer, &fixture->gpu, &changes, &fixture->times, error);
}

static void update(struct fixture *fixture)
{
    struct error error = {0};
    expect_ok(try_update(fixture, &error), &error);
}

static void fixture_init(struct fixture *fixture, struct scene *scene, const struct tracer_options *options)
{
    struct error error = {0};
    *fixture = (struct fixture){
        .scene = scene, .edits = {.scene = scene}, .memory_before_bytes = device->memory_used_bytes};
    scene_gpu_init(&fixture->gpu, device);
    fixture->tracer = tracer_create(tracer_impl_by_number(NUMBER_ABUFFER), device, options, &error);
    expect_ok(fixture->tracer != NULL, &error);
    update(fixture);
}

static void fixture_finish(struct fixture *fixture)
{
    tracer_destroy(fixture->tracer);
    scene_gpu_finish(&fixture->gpu);
    scene_motion_finish(&fixture->motion);
    scene_destroy(fixture->scene);
    assert_int_equal(device->memory_used_bytes, fixture->memory_before_bytes);
}

static const struct tracer_cube *cube(const struct fixture *fixture)
{
    return &fixture->tracer->stats.cubes[TRACER_CUBE_STATIC];
}

/* Whether the last update built it, by what it says and by where its time went. */
static void expect_built(const struct fixture *fixture, bool expected)
{
    bool timed[2] = {false}; /* by the CPU's clock and by the GPU's */
    for (uint32_t i = 0; i < fixture->times.count; i++) {
        assert_int_equal(fixture->times.spans[i].stage, STAGE_BUILD);
        timed[fixture->times.spans[i].clock] |= fixture->times.spans[i].duration_ns > 0;
    }
    assert_int_equal(cube(fixture)->rebuilt, expected);
    assert_int_equal(timed[STAGE_CPU], expected);
    assert_int_equal(timed[STAGE_GPU], expected);
    assert_int_equal(fixture->tracer->stats.uploaded_bytes > 0, expected);
    assert_int_equal(fixture->tracer->stats.nodes_rebuilt, expected ? fixture->tracer->stats.nodes : 0);
}

/* How far something is below a point at a height of 10, a little askew so that no ray lies on an edge between
 * cells; negative where nothing is. */
static float distance_below(struct fixture *fixture, float x, float y)
{
    struct ray ray = {.origin_t_min = {x + 0.013f, y + 0.017f, 10, 0}, .direction_t_max = {0, 0, -1, 1e9f}};
    struct gpu_buffer rays = {0}, hits = {0};
    struct error error = {0};
    struct hit hit;
    expect_ok(gpu_buffer_upload(device, &rays, &ray, sizeof(ray), &error), &error);
    expect_ok(gpu_buffer_reserve(device, &hits, sizeof(hit), &error), &error);
    const struct wave wave = {.rays = &rays, .hits = &hits, .ray_count = 1};
    scene_gpu_bind(&fixture->gpu);
    expect_ok(tracer_trace(fixture->tracer, &fixture->gpu, &wave, &error), &error);
    gpu_buffer_read(device, &hits, 0, &hit, sizeof(hit));
    gpu_buffer_finish(device, &rays);
    gpu_buffer_finish(device, &hits);
    return hit.distance;
}

static void expect_distance(const struct fixture *fixture, float distance, double expected)
{
    if (!(fabs((double)distance - expected) < (double)cube(fixture)->cell_metres))
        fail_msg("%g metres, where it is %g", (double)distance, expected);
}

/* Boxes of two metres on the axis x, three metres apart. */
static void add_box(struct test_edits *edits, uint32_t node, float x)
{
    float m[12];
    test_transform(m, 1, 1, 1, 0, 0, x, 0, 0);
    test_node(edits, node, 0, NODE_MESH, 1, m);
}

static struct scene *scene_of_boxes(uint32_t count)
{
    struct test_edits edits = {.scene = test_scene_create()};
    add_box_mesh(&edits, 1);
    for (uint32_t i = 0; i < count; i++)
        add_box(&edits, i + 1, 3 * (float)i);
    test_commit(&edits);
    return edits.scene;
}

static void options_out_of_range_are_refused_by_name(void **state)
{
    (void)state;
    static const struct {
        const char *field;
        struct tracer_options options;
    } rows[] = {
        {"options.abuffer_resolution", {.abuffer_resolution = 15}},
        {"options.abuffer_resolution", {.abuffer_resolution = 4097}},
        {"options.abuffer_voxels", {.abuffer_voxels = 8}},
        {"options.abuffer_voxels", {.abuffer_voxels = 100}},
        {"options.abuffer_voxels", {.abuffer_voxels = 512}},
        {"options.abuffer_voxels", {.abuffer_resolution = 64, .abuffer_voxels = 128}},
        {"options.abuffer_search", {.abuffer_search = ABUFFER_SEARCH_LINEAR1 + 1}},
    };
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        struct error error = {0};
        assert_null(tracer_create(tracer_impl_by_number(NUMBER_ABUFFER), device, &rows[i].options, &error));
        assert_int_equal(error.kind, ERROR_INVALID);
        assert_string_equal(error.field, rows[i].field);
    }
}

static void it_says_how_large_it_is(void **state)
{
    (void)state;
    struct fixture fixture;
    fixture_init(&fixture, scene_of_boxes(3), &small); /* 8 x 2 x 2 */
    expect_built(&fixture, true);
    assert_int_equal(cube(&fixture)->resolution, RESOLUTION);
    assert_float_equal(cube(&fixture)->cell_metres, 8.0f / (RESOLUTION - MARGIN_CELLS), 1e-6f);
    assert_int_equal(cube(&fixture)->layers_needed,
                     6); /* along x: a side to the left and one to the right of each */
    assert_int_equal(cube(&fixture)->layers_kept, 6);
    assert_int_equal(cube(&fixture)->samples_lost, 0);
    /* Sides of 2 x 2 of 8: along x six of them, along the others three times two. */
    double side = 2 / (double)cube(&fixture)->cell_metres;
    assert_in_range(cube(&fixture)->samples, 18 * (side - 1) * (side - 1), 18 * (side + 1) * (side + 1));
    assert_int_equal(fixture.tracer->stats.nodes, cube(&fixture)->samples);
    assert_in_range(fixture.tracer->stats.device_bytes, 3 * RESOLUTION * RESOLUTION * 8, UINT64_MAX);
    add_box(&fixture.edits, 4, 30);
    update(&fixture);
    assert_float_equal(cube(&fixture)->cell_metres, 32.0f / (RESOLUTION - MARGIN_CELLS), 1e-6f);
    expect_distance(&fixture, distance_below(&fixture, 30, 0), 9);
    fixture_finish(&fixture);
}

static void it_is_built_when_something_changes_and_at_no_other_time(void **state)
{
    (void)state;
    struct fixture fixture;
    float m[12];
    fixture_init(&fixture, scene_of_boxes(2), &small);
    expect_built(&fixture, true);
    expect_distance(&fixture, distance_below(&fixture, 0, 0), 9);
    update(&fixture);
    expect_built(&fixture, false);
    test_material(&fixture.edits, 1, 0.1f, 0.2f, 0.3f); /* in use by nobody, nor cut out */
    update(&fixture);
    expect_built(&fixture, false);
    test_transform(m, 1, 1, 1, 0, 0, 0, 0, 2);
    test_node(&fixture.edits, 1, 0, NODE_MESH, 1, m);
    update(&fixture);
    expect_built(&fixture, true);
    expect_distance(&fixture, distance_below(&fixture, 0, 0), 7);
    test_node(&fixture.edits, 1, 0, NODE_MESH, 1, m)->hidden = true;
    update(&fixture);
    expect_built(&fixture, true);
    assert_true(distance_below(&fixture, 0, 0) < 0);
    expect_distance(&fixture, distance_below(&fixture, 3, 0), 9);
    fixture_finish(&fixture);
}

static void what_deforms_is_built_where_it_went(void **state)
{
    (void)state;
    struct fixture fixture;
    fixture_init(&fixture, scene_of_a_crumpled_body(), &small);
    uint64_t samples = cube(&fixture)->samples;
    for (int p = 0; p < 3; p++) {
        const float weights[TEST_TARGETS] = {0.4f * (float)p, 0};
        scene_motion_finish(&fixture.motion);
        test_motion_init(&fixture.motion, 1);
        test_pose_weights(&fixture.motion.poses[0], 1, weights, TEST_TARGETS);
        update(&fixture);
        expect_built(&fixture, true);
        assert_true(cube(&fixture)->samples != samples);
        samples = cube(&fixture)->samples;
        update(&fixture);
        expect_built(&fixture, false);
    }
    fixture_finish(&fixture);
}

/* A material that begins to be cut out, or no longer is, makes other samples. */
static void cutouts_are_part_of_it(void **state)
{
    (void)state;
    struct fixture fixture;
    fixture_init(&fixture, scene_of_cut_bodies(), &small);
    uint64_t cut = cube(&fixture)->samples;
    test_material(&fixture.edits, 1, 0.4f, 0.5f, 0.6f);
    update(&fixture);
    expect_built(&fixture, true);
    uint64_t whole = cube(&fixture)->samples;
    assert_true(whole > cut);
    struct scene_material *cutout = test_material(&fixture.edits, 1, 0.4f, 0.5f, 0.6f);
    cutout->alpha_mode = ALPHA_MASK;
    cutout->base_colour[3] = 0.25f;
    update(&fixture);
    expect_built(&fixture, true);
    assert_int_equal(cube(&fixture)->samples, cut);
    cutout = test_material(&fixture.edits, 1, 0.9f, 0.5f, 0.6f); /* of another colour */
    cutout->alpha_mode = ALPHA_MASK;
    cutout->base_colour[3] = 0.25f;
    update(&fixture);
    assert_int_equal(cube(&fixture)->samples, cut);
    fixture_finish(&fixture);
}

static void an_empty_scene_is_missed(void **state)
{
    (void)state;
    struct fixture fixture;
    fixture_init(&fixture, test_scene_create(), &small);
    assert_int_equal(cube(&fixture)->resolution, 0);
    assert_true(distance_below(&fixture, 0, 0) < 0);
    add_box_mesh(&fixture.edits, 1);
    add_box(&fixture.edits, 1, 0);
    update(&fixture);
    expect_distance(&fixture, distance_below(&fixture, 0, 0), 9);
    test_node(&fixture.edits, 1, 0, NODE_MESH, 1, NULL)->hidden = true;
    update(&fixture);
    assert_int_equal(cube(&fixture)->resolution, 0);
    assert_true(distance_below(&fixture, 0, 0) < 0);
    fixture_finish(&fixture);
}

static void after_a_failure_the_next_update_starts_anew(void **state)
{
    (void)state;
    static const struct tracer_options little = {.abuffer_resolution = RESOLUTION, .abuffer_mebibytes_max = 1};
    struct fixture fixture;
    struct error error = {0};
    float m[12];
    fixture_init(&fixture, scene_of_boxes(1), &little);
    expect_distance(&fixture, distance_below(&fixture, 0, 0), 9);
    test_transform(m, 1, 1, 1, 0, 0, 0, 0, 0);
    for (uint32_t i = 0; i < 40; i++) /* as many at one place */
        test_node(&fixture.edits, i + 2, 0, NODE_MESH, 1, m);
    assert_false(try_update(&fixture, &error));
    assert_int_equal(error.kind, ERROR_LIMIT);
    assert_string_equal(error.field, "abuffer");
    assert_int_equal(cube(&fixture)->resolution, 0);
    for (uint32_t i = 0; i < 40; i++)
        test_node(&fixture.edits, i + 2, 0, NODE_MESH, 1, m)->hidden = true;
    update(&fixture);
    expect_distance(&fixture, distance_below(&fixture, 0, 0), 9);
    fixture_finish(&fixture);
}

/* Grids are as fine as the images ask for: about sqrt(3 N). */
static void voxels_follow_the_resolution(void **state)
{
    (void)state;
    static const struct {
        uint32_t resolution;
        uint64_t voxels;
    } rows[] = {{16, 16}, {128, 16}, {256, 32}, {1024, 64}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        struct fixture chosen, asked;
        const struct tracer_options options[2] = {
            {.abuffer_resolution = rows[i].resolution},
            {.abuffer_resolution = rows[i].resolution, .abuffer_voxels = (uint32_t)rows[i].voxels},
        };
        fixture_init(&asked, scene_of_boxes(1), &options[1]);
        uint64_t bytes = asked.tracer->stats.device_bytes;
        fixture_finish(&asked);
        fixture_init(&chosen, scene_of_boxes(1), &options[0]);
        assert_int_equal(chosen.tracer->stats.device_bytes, bytes);
        fixture_finish(&chosen);
    }
}

static int open_device(void **state)
{
    (void)state;
    struct error error = {0};
    device = gpu_device_create(&(struct gpu_options){.index = -1, .debug = true}, &error);
    if (!device)
        print_message("no device: %s\n", error.text);
    return device ? 0 : -1;
}

static int close_device(void **state)
{
    (void)state;
    gpu_device_destroy(device);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(options_out_of_range_are_refused_by_name),
        cmocka_unit_test(it_says_how_large_it_is),
        cmocka_unit_test(it_is_built_when_something_changes_and_at_no_other_time),
        cmocka_unit_test(what_deforms_is_built_where_it_went),
        cmocka_unit_test(cutouts_are_part_of_it),
        cmocka_unit_test(an_empty_scene_is_missed),
        cmocka_unit_test(after_a_failure_the_next_update_starts_anew),
        cmocka_unit_test(voxels_follow_the_resolution),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
