/* SPDX-License-Identifier: MIT */
/* Promises of the tracer `ldc` beside its hits: still geometry is built once, moving geometry costs its
 * frame, and it reports the size of its cells and its losses. tests/accuracy/sampled_against_reference.c
 * shows that hits are right up to the size of a cell. */
#include "tests/unit/trace/stack_scene.h"
#include "tests/unit/trace/tracer_fixture.h"

#include "render/frame/tracer_set.h"
#include "tests/fixtures/structure.h"
#include "tests/harness/test.h"
#include "trace/ldc/store.h"

#define RESOLUTION 64u
#define MARGIN_CELLS 2u /* margin of the resolution without scene: one on either side */

static const struct tracer_options small = {.ldc = {.resolution = RESOLUTION}};

static void fixture_init(struct fixture *fixture, struct scene *scene, const struct tracer_options *options)
{
    fixture_init_by(fixture, TRACER_LDC, scene, options);
}

/* Which cubes the last update built, by what it says and by where its time went. */
static void expect_built(const struct fixture *fixture, bool static_cube, bool dynamic_cube)
{
    const bool expected[LDC_CUBES_MAX] = {static_cube, dynamic_cube};
    bool timed[LDC_CUBES_MAX][2] = {{false}}; /* by the CPU's clock and by the GPU's */
    for (uint32_t i = 0; i < fixture->times.count; i++) {
        const struct record_stage_time *span = &fixture->times.spans[i];
        assert_int_equal(span->stage, STAGE_BUILD);
        assert_in_range(span->wave, 0, LDC_CUBES_MAX - 1);
        timed[span->wave][span->clock] |= span->duration_ns > 0;
    }
    for (unsigned i = 0; i < LDC_CUBES_MAX; i++) {
        assert_int_equal(told(fixture->tracer, i == LDC_CUBE_STATIC ? "static/built" : "dynamic/built"),
                         expected[i]);
        assert_int_equal(timed[i][CLOCK_CPU], expected[i]);
        assert_int_equal(timed[i][CLOCK_GPU], expected[i]);
    }
    /* Samples are made on the device; what goes there is a few words an instance of what is built. */
    uint64_t uploaded_bytes = fixture->tracer->stats.uploaded_bytes;
    assert_int_equal(uploaded_bytes > 0, static_cube || dynamic_cube);
    assert_in_range(uploaded_bytes, 0, 64 * (uint64_t)fixture->gpu.instance_count);
    uint64_t nodes = fixture->tracer->stats.nodes, rebuilt = fixture->tracer->stats.nodes_rebuilt;
    assert_int_equal(rebuilt == 0, !static_cube && !dynamic_cube);
    if (static_cube && (dynamic_cube || told(fixture->tracer, "dynamic/resolution") == 0))
        assert_int_equal(rebuilt, nodes);
}

/* ---- scenes and rays ---- */

static void add_box(struct test_edits *edits, uint32_t node, float size, float x, float y, float z)
{
    float m[12];
    test_transform(m, 0.5f * size, 0.5f * size, 0.5f * size, 0, 0, x, y, z);
    test_node(edits, node, 0, NODE_MESH, 10, m);
}

/* Boxes of one unit: node i + 1 at x = 2 i. */
static struct scene *scene_of_boxes(uint32_t count)
{
    struct test_edits edits = {.scene = test_scene_create()};
    add_box_mesh(&edits, 10);
    for (uint32_t i = 0; i < count; i++)
        add_box(&edits, i + 1, 1, 2 * (float)i, 0, 0);
    test_commit(&edits);
    return edits.scene;
}

/* Boxes' tops are flat: the plane of a sample is the face, so distances are right to the rounding of cells. */
static void expect_distance(float distance, double expected)
{
    if (!(fabs((double)distance - expected) < 1e-4 * expected))
        fail_msg("distance %.9g, expected %.9g", (double)distance, expected);
}

/* ---- tests ---- */

ALL_TESTS(open_device, close_device)

TEST(options_out_of_range_are_refused_by_name)
{
    static const struct refused_options rows[] = {
        {"options.ldc_resolution", {.ldc = {.resolution = 15}}},
        {"options.ldc_resolution", {.ldc = {.resolution = 4097}}},
        {"options.ldc_form", {.ldc = {.form = TRACER_FORM_PAPER + 1}}},
        {"options.ldc_layers", {.limits = {.ldc_layers = 256}}},
    };
    expect_options_refused(TRACER_LDC, rows, sizeof(rows) / sizeof(rows[0]));
}

TEST(the_size_of_a_cell_is_that_of_the_longest_side)
{
    struct fixture fixture;
    fixture_init(&fixture, scene_of_boxes(3), &small); /* 5 x 1 x 1 */
    expect_built(&fixture, true, false);
    assert_int_equal(told(fixture.tracer, "static/resolution"), RESOLUTION);
    assert_int_equal(told(fixture.tracer, "dynamic/resolution"), 0);
    assert_float_equal(described_metres(fixture.tracer, "static/cell"), 5.0f / (RESOLUTION - MARGIN_CELLS), 1e-6f);
    assert_int_equal(told(fixture.tracer, "static/layers_needed"),
                     6); /* along x: each box has a side to the left and one to the right */
    assert_int_equal(told(fixture.tracer, "static/layers_kept"), 6);
    assert_int_equal(told(fixture.tracer, "static/samples_lost"), 0);
    assert_in_range(fixture.tracer->stats.device_bytes, 3 * RESOLUTION * RESOLUTION * 16, UINT64_MAX);
    add_box(&fixture.edits, 4, 1, 19.5f, 0, 0); /* the scene is four times as long */
    update(&fixture);
    assert_float_equal(described_metres(fixture.tracer, "static/cell"), 20.5f / (RESOLUTION - MARGIN_CELLS),
                       1e-5f);
    expect_distance(distance_below(&fixture, 19.5f, 0), 9.5);
    fixture_finish(&fixture);
}

TEST(what_begins_to_move_leaves_the_static_cube_once)
{
    struct fixture fixture;
    fixture_init(&fixture, scene_of_boxes(3), &small);
    add_box(&fixture.edits, 3, 1, 4, 0, 1);
    update(&fixture);
    expect_built(&fixture, true, true);
    float static_cell = described_metres(fixture.tracer, "static/cell");
    assert_float_equal(static_cell, 3.0f / (RESOLUTION - MARGIN_CELLS), 1e-6f);
    for (int step = 0; step < 3; step++) {
        add_box(&fixture.edits, 3, 1, 4, (float)step, 2);
        update(&fixture);
        expect_built(&fixture, false, true);
        assert_float_equal(described_metres(fixture.tracer, "static/cell"), static_cell, 0);
        assert_float_equal(described_metres(fixture.tracer, "dynamic/cell"), 1.0f / (RESOLUTION - MARGIN_CELLS),
                           1e-6f);
        expect_distance(distance_below(&fixture, 4, (float)step), 7.5);
        expect_distance(distance_below(&fixture, 0, 0), 9.5);
        if (step > 0)
            assert_true(distance_below(&fixture, 4, (float)step - 1) < 0); /* where it was */
    }
    update(&fixture);
    expect_built(&fixture, false, false);
    fixture_finish(&fixture);
}

TEST(what_has_moved_back_stays_dynamic)
{
    struct fixture fixture;
    fixture_init(&fixture, scene_of_boxes(2), &small);
    add_box(&fixture.edits, 1, 1, 0, 0, 1);
    update(&fixture);
    add_box(&fixture.edits, 1, 1, 0, 0, 0);
    update(&fixture);
    expect_built(&fixture, false, true);
    expect_distance(distance_below(&fixture, 0, 0), 9.5);
    add_box(&fixture.edits, 2, 1, 2, 0, 3); /* the last one: nothing is left in the static cube */
    update(&fixture);
    assert_int_equal(told(fixture.tracer, "static/resolution"), 0);
    expect_built(&fixture, false, true);
    expect_distance(distance_below(&fixture, 0, 0), 9.5);
    expect_distance(distance_below(&fixture, 2, 0), 6.5);
    fixture_finish(&fixture);
}

TEST(what_was_hidden_and_comes_back_is_dynamic)
{
    struct fixture fixture;
    fixture_init(&fixture, scene_of_boxes(3), &small);
    for (int turn = 0; turn < 2; turn++) {
        test_node(&fixture.edits, 1, 0, NODE_MESH, 10, NULL)->value.hidden = true;
        update(&fixture);
        expect_built(&fixture, turn == 0, false);
        assert_true(distance_below(&fixture, 0, 0) < 0);
        assert_int_equal(told(fixture.tracer, "dynamic/resolution"), 0);
        add_box(&fixture.edits, 1, 1, 0, 0, 0);
        update(&fixture);
        expect_built(&fixture, false, true);
        expect_distance(distance_below(&fixture, 0, 0), 9.5);
    }
    fixture_finish(&fixture);
}

TEST(new_objects_are_static_and_settle_what_stood_still)
{
    struct fixture fixture;
    fixture_init(&fixture, scene_of_boxes(3), &small);
    add_box(&fixture.edits, 1, 1, 0, 0, 1);
    update(&fixture);
    add_box(&fixture.edits, 2, 1, 2, 0, 1);
    update(&fixture);
    expect_built(&fixture, true, true);
    add_box_mesh(&fixture.edits, 11);
    test_node(&fixture.edits, 9, 0, NODE_MESH, 11, (const float[12]){0.5f, 0, 0, 8, 0, 0.5f, 0, 0, 0, 0, 0.5f, 0});
    update(&fixture); /* the first box has settled, the second was on the move until now */
    expect_built(&fixture, true, true);
    assert_float_equal(described_metres(fixture.tracer, "dynamic/cell"), 1.0f / (RESOLUTION - MARGIN_CELLS),
                       1e-6f);
    static const float distances[] = {8.5f, 8.5f, 9.5f};
    for (int i = 0; i < 3; i++)
        expect_distance(distance_below(&fixture, 2 * (float)i, 0), (double)distances[i]);
    expect_distance(distance_below(&fixture, 8, 0), 9.5);
    struct scene_edit *edit = test_add(&fixture.edits, OBJECT_NODE);
    edit->kind = EDIT_REMOVE;
    edit->id = 9;
    update(&fixture);
    expect_built(&fixture, true, true);
    assert_true(distance_below(&fixture, 8, 0) < 0);
    fixture_finish(&fixture);
}

/* A mesh that is sent anew again and again moves, as it were. */
TEST(a_mesh_that_is_set_again_is_dynamic)
{
    struct fixture fixture;
    struct scene *scene = scene_of_boxes(2);
    fixture_init(&fixture, scene, &small);
    add_box_mesh(&fixture.edits, 11);
    test_node(&fixture.edits, 9, 0, NODE_MESH, 11, (const float[12]){0.5f, 0, 0, 0, 0, 0.5f, 0, 3, 0, 0, 0.5f, 0});
    update(&fixture);
    expect_built(&fixture, true, false);
    for (int turn = 0; turn < 3; turn++) {
        add_box_mesh(&fixture.edits, 11);
        update(&fixture);
        expect_built(&fixture, turn == 0, true);
        expect_distance(distance_below(&fixture, 0, 3), 9.5);
    }
    fixture_finish(&fixture);
}

TEST(a_skinned_mesh_is_dynamic_from_the_first)
{
    struct fixture fixture;
    fixture_init(&fixture, test_scene_deformed(), &small);
    expect_built(&fixture, true, true); /* rigid nodes 6 and 7; skins and targets 2, 4, 5 */
    float static_cell = described_metres(fixture.tracer, "static/cell");
    for (uint32_t turn = 0; turn < 2; turn++) {
        scene_motion_finish(&fixture.motion);
        test_motion_init(&fixture.motion, 1);
        float m[12];
        test_transform(m, 1, 1, 1, 2, 0.9f + 0.2f * (float)turn, 0.2f, 0.3f, 0);
        test_pose_node(&fixture.motion.poses[0], 11, m);
        update(&fixture);
        expect_built(&fixture, false, true);
        assert_float_equal(described_metres(fixture.tracer, "static/cell"), static_cell, 0);
    }
    fixture_finish(&fixture);
}

TEST(an_edit_of_a_texture_builds_all_and_a_factor_nothing)
{
    struct fixture fixture;
    fixture_init(&fixture, test_scene_translucent(), &small);
    struct scene_material glass = *scene_material(fixture.scene, 3);
    struct scene_material *edited = test_material(&fixture.edits, 3, 0.1f, 0.2f, 0.3f);
    memcpy(edited->textures, glass.textures, sizeof(glass.textures));
    edited->value.transmission = 0.2f;
    update(&fixture);
    expect_built(&fixture, false, false);
    test_texture(&fixture.edits, 2, 5, 5, TEXTURE_RGBA8_LINEAR, WRAP_CLAMP, WRAP_REPEAT, 20);
    update(&fixture);
    expect_built(&fixture, true, false);
    fixture_finish(&fixture);
}

/* Squares without thickness, six of them one above the other. */
static struct scene *scene_of_squares(void)
{
    static const float positions[4][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    struct test_edits edits = {.scene = test_scene_create()};
    test_mesh(&edits, 10, positions, 4, indices, 2);
    for (uint32_t i = 0; i < 6; i++) {
        float m[12];
        test_transform(m, 1, 1, 1, 0, 0, 0, 0, 0.25f * (float)i);
        test_node(&edits, i + 1, 0, NODE_MESH, 10, m);
    }
    test_commit(&edits);
    return edits.scene;
}

TEST(more_layers_than_may_be_kept_are_reported_and_the_nearest_stay)
{
    const struct tracer_options options = {.ldc = {.resolution = RESOLUTION}, .limits = {.ldc_layers = 2}};
    struct fixture fixture;
    fixture_init(&fixture, scene_of_squares(), &options);
    assert_int_equal(told(fixture.tracer, "static/layers_needed"), 6);
    assert_int_equal(told(fixture.tracer, "static/layers_kept"), 2);
    assert_int_equal(told(fixture.tracer, "static/samples_lost"), 2 * told(fixture.tracer, "static/samples"));
    assert_non_null(strstr(described_row(fixture.tracer, "static/layers_kept").warning, "2 of 6 layers"));
    expect_distance(distance_below(&fixture, 0, 0), 9.75); /* z = 0.25, the second from below: minimum depths */
    const struct ray up = {{0.013f, 0.017f, -10, 0}, {0, 0, 1, 1e9f}};
    expect_distance(trace_one(&fixture, up).distance, 10);
    fixture_finish(&fixture);
}

TEST(after_a_failure_the_next_update_starts_anew)
{
    struct fixture fixture;
    struct error error = {0};
    fixture_init(&fixture, scene_of_boxes(3), &small);
    add_box(&fixture.edits, 3, 1, 1e30f, 0, 0);
    assert_false(try_update(&fixture, &error));
    assert_int_equal(error.kind, ERROR_LIMIT);
    assert_string_equal(error.field, "scene");
    assert_int_equal(told(fixture.tracer, "static/resolution"), 0);
    add_box(&fixture.edits, 3, 1, 4, 0, 0);
    update(&fixture);
    expect_built(&fixture, true, false);
    expect_distance(distance_below(&fixture, 4, 0), 9.5);
    fixture_finish(&fixture);
}

/* A renderer that is switched between tracers makes these requests. */
TEST(a_tracer_that_was_away_builds_what_has_changed_meanwhile)
{
    static const struct tracer_options options = {.ldc = {.resolution = RESOLUTION}};
    struct change_history history = {0};
    struct tracer_set set = {.history = &history};
    struct fixture fixture = {.scene = scene_of_boxes(3), .memory_before_bytes = device->memory_used_bytes};
    struct error error = {0};
    struct scene_changes changes;
    fixture.edits.scene = fixture.scene;
    gpu_scene_init(&fixture.gpu, device);
    static const struct {
        unsigned tracer;
        bool moves, static_cube, dynamic_cube;
    } frames[] = {
        {TRACER_LDC, false, true, false}, {TRACER_BVH, false, false, false}, {TRACER_LDC, false, false, false},
        {TRACER_BVH, true, false, false}, {TRACER_LDC, false, true, true},   {TRACER_BVH, true, false, false},
        {TRACER_LDC, false, false, true}, {TRACER_LDC, false, false, false},
    };
    for (size_t i = 0; i < sizeof(frames) / sizeof(frames[0]); i++) {
        if (frames[i].moves) {
            add_box(&fixture.edits, 1, 1, 0, 0, 0.5f * (float)i);
            test_commit(&fixture.edits);
        }
        expect_ok(gpu_scene_update(&fixture.gpu, fixture.scene, NULL, &changes, NULL, &error), &error);
        change_history_note(&history, changes.bits);
        stage_times_begin(&fixture.times);
        fixture.tracer = tracer_set_take(&set, device, tracer_impl_by_number(frames[i].tracer), &options, &error);
        expect_ok(fixture.tracer != NULL, &error);
        enum tracer_progress progress = TRACER_MORE;
        while (progress == TRACER_MORE)
            progress = tracer_set_bring(&set, fixture.tracer, &fixture.gpu,
                                        &(struct tracer_update){.times = &fixture.times}, 0, &error);
        expect_ok(progress == TRACER_DONE, &error);
        if (frames[i].tracer == TRACER_LDC)
            expect_built(&fixture, frames[i].static_cube, frames[i].dynamic_cube);
        tracer_set_give(&set, fixture.tracer);
    }
    expect_distance(distance_below(&fixture, 0, 0), 10 - 0.5 - 0.5 * 5);
    fixture.tracer = NULL; /* the set's */
    tracer_set_finish(&set);
    fixture_finish(&fixture);
}
