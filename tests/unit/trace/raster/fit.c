/* SPDX-License-Identifier: MIT */
/* Layers are counted before a structure of samples is built: their number is right, deep scenes get a coarser
 * structure or none, and all others the one that was asked for. */
#include "tests/unit/trace/tracer_fixture.h"

#include "tests/fixtures/structure.h"
#include "tests/harness/test.h"
#include "trace/raster/draw.h"
#include "trace/raster/fit.h"
#include "raster/layout.h"

#define RESOLUTION 256u
/* Both scenes have more at this resolution. */
#define SAMPLES_MAX 1000000u
/* Tolerance of the prediction: texels at silhouettes are in or out. ldc keeps one of the samples that
 * coincide. */
#define TOLERANCE 0.1
/* Rods that lie along the texels cover whole rows or none: of 20 places, each covered with a chance of 0.6, the
 * number has a standard deviation of 0.18 of its mean. */
#define LATTICE_TOLERANCE 0.4

static const unsigned sampled[] = {TRACER_LDC, TRACER_ABUFFER};

/* ---- scenes ---- */

static void add_shells(struct test_edits *edits, uint32_t count)
{
    float(*spheres)[4] = calloc(count, sizeof(*spheres));
    for (uint32_t i = 0; i < count; i++)
        spheres[i][3] = (float)(i + 1) / (float)count;
    test_spheres(edits, 1, (const float(*)[4])spheres, count);
    test_node(edits, 1, 0, NODE_SPHERES, 1, NULL);
    free(spheres);
}

static struct scene *nested_shells(uint32_t count)
{
    struct test_edits edits = {.scene = test_scene_create()};
    add_shells(&edits, count);
    test_commit(&edits);
    return edits.scene;
}

enum { ROD_TRIANGLES = 8 };

/* An open tube of square section, a metre long, along an axis. */
static void add_rod(struct test_edits *edits, uint32_t id, uint32_t axis, float half_width)
{
    float positions[8][3];
    uint32_t triangles[ROD_TRIANGLES][3];
    for (uint32_t i = 0; i < 8; i++) {
        const uint32_t corner = i % 4;
        positions[i][axis] = i < 4 ? 0.0f : 1.0f;
        positions[i][(axis + 1) % 3] = corner == 1 || corner == 2 ? half_width : -half_width;
        positions[i][(axis + 2) % 3] = corner >= 2 ? half_width : -half_width;
    }
    for (uint32_t i = 0; i < 4; i++) {
        const uint32_t next = (i + 1) % 4;
        memcpy(triangles[2 * i], (uint32_t[3]){i, next, i + 4}, sizeof(triangles[0]));
        memcpy(triangles[2 * i + 1], (uint32_t[3]){next, next + 4, i + 4}, sizeof(triangles[0]));
    }
    test_mesh(edits, id, (const float(*)[3])positions, 8, (const uint32_t *)triangles, ROD_TRIANGLES);
}

/* A lattice of along x along rods on each axis; a rod is about a texel wide. */
static struct scene *lattice(uint32_t along)
{
    struct test_edits edits = {.scene = test_scene_create()};
    uint32_t node = 0;
    for (uint32_t axis = 0; axis < 3; axis++)
        add_rod(&edits, axis + 1, axis, 0.0017f);
    for (uint32_t i = 0; i < 3 * along * along; i++) {
        const uint32_t axis = i % 3;
        float m[12], place[3] = {0};
        place[(axis + 1) % 3] = (float)(i / 3 % along) / (float)(along - 1);
        place[(axis + 2) % 3] = (float)(i / 3 / along) / (float)(along - 1);
        test_transform(m, 1, 1, 1, 0, 0, place[0], place[1], place[2]);
        test_node(&edits, ++node, 0, NODE_MESH, axis + 1, m);
    }
    test_commit(&edits);
    return edits.scene;
}

/* Plates above each other, of a side, in a corner of a floor a metre wide. */
static void add_stack(struct test_edits *edits, uint32_t count, float side)
{
    static const uint32_t triangles[2][3] = {{0, 1, 2}, {0, 2, 3}};
    float positions[2][4][3];
    for (int which = 0; which < 2; which++)
        for (int i = 0; i < 4; i++) {
            const float along = which ? side : 1.0f;
            memcpy(positions[which][i], (float[3]){i == 1 || i == 2 ? along : 0, 0, i > 1 ? along : 0}, 12);
        }
    for (uint32_t which = 0; which < 2; which++)
        test_mesh(edits, which + 1, (const float(*)[3])positions[which], 4, (const uint32_t *)triangles, 2);
    for (uint32_t i = 0; i <= count; i++) {
        float m[12];
        test_transform(m, 1, 1, 1, 0, 0, 0, (float)i / (float)count, 0);
        test_node(edits, i + 1, 0, NODE_MESH, i == 0 ? 1 : 2, m);
    }
}

/* ---- what is told ---- */

static const char *row_of(unsigned tracer, const char *ldc_name)
{
    return tracer == TRACER_LDC ? ldc_name : strchr(ldc_name, '/') + 1;
}

static struct tracer_options options_at(uint32_t resolution)
{
    return (struct tracer_options){.ldc = {.resolution = resolution}, .abuffer = {.resolution = resolution}};
}

static struct axes_layers count_layers(const struct fixture *fixture, float overlap, float steep,
                                       float longest_world)
{
    const struct axes_box whole = {.cell_world = longest_world};
    uint32_t *instances = NULL, count = 0;
    struct error error = {0};
    expect_ok(axes_list_instances(&fixture->gpu, &instances, &count, &error), &error);
    const struct axes_layers layers = axes_count_layers(&fixture->gpu, instances, count, overlap, steep, &whole);
    free(instances);
    return layers;
}

static double predicted_samples(const struct fixture *fixture, unsigned tracer)
{
    const double along = (double)told(fixture->tracer, row_of(tracer, "static/resolution"));
    const double cell_world = (double)described_metres(fixture->tracer, row_of(tracer, "static/cell"));
    const struct axes_layers layers =
        tracer == TRACER_LDC ? count_layers(fixture, AXES_OVERLAP, 0, (float)(along * cell_world))
                             : count_layers(fixture, 0, FACE_STEEP_BELOW, (float)(along * cell_world));
    return layers.mean * 3 * along * along;
}

static void expect_predicted(const struct fixture *fixture, unsigned tracer, double tolerance)
{
    const double samples = (double)told(fixture->tracer, row_of(tracer, "static/samples"));
    const double predicted = predicted_samples(fixture, tracer);
    if (!(fabs(samples - predicted) < tolerance * samples))
        fail_msg("%s: %.0f samples, where %.0f were predicted", fixture->tracer->impl->name, samples, predicted);
}

/* ---- tests ---- */

ALL_TESTS(open_device, close_device)

TEST(usual_scenes_have_the_resolution_that_was_asked_for)
{
    const struct tracer_options options = options_at(RESOLUTION);
    for (size_t i = 0; i < 2; i++)
        for (int which = 0; which < 2; which++) {
            struct fixture fixture;
            fixture_init_by(&fixture, sampled[i], which ? test_scene_soup() : test_scene_spheres(), &options);
            const struct structure_row row =
                described_row(fixture.tracer, row_of(sampled[i], "static/resolution"));
            assert_int_equal(row.number, RESOLUTION);
            assert_string_equal(row.warning, "");
            expect_predicted(&fixture, sampled[i], TOLERANCE);
            fixture_finish(&fixture);
        }
}

TEST(deep_scenes_have_a_lower_one_and_a_warning)
{
    const struct tracer_options options = options_at(RESOLUTION);
    const struct gpu_facts facts = device->facts;
    device->facts.axes_samples_max = SAMPLES_MAX;
    for (size_t i = 0; i < 2; i++)
        for (int which = 0; which < 2; which++) {
            const double tolerance = which ? TOLERANCE : LATTICE_TOLERANCE;
            struct fixture fixture;
            fixture_init_by(&fixture, sampled[i], which ? nested_shells(30) : lattice(20), &options);
            const struct structure_row row =
                described_row(fixture.tracer, row_of(sampled[i], "static/resolution"));
            assert_in_range(row.number, AXES_FITTED_MIN, RESOLUTION - 1);
            assert_non_null(strstr(row.warning, "instead of 256 texels"));
            expect_predicted(&fixture, sampled[i], tolerance);
            /* The resolution is as fine as is allowed: a texel more along a side would be less than a
             * hundredth. */
            const double samples = (double)told(fixture.tracer, row_of(sampled[i], "static/samples"));
            assert_true(samples < (1 + tolerance) * SAMPLES_MAX);
            assert_true(samples > (1 - tolerance - 0.02) * SAMPLES_MAX);
            fixture_finish(&fixture);
        }
    device->facts = facts;
}

static uint32_t chosen(const struct tracer_options *options, unsigned tracer, double layers, uint32_t asked)
{
    const struct tracer stand_in = {.impl = tracer_impl_by_number(tracer), .device = device, .options = *options};
    return axes_choose_resolution(&stand_in, layers, &(struct axes_request){asked, 1024, 4});
}

TEST(a_resolution_that_was_asked_for_is_taken_whatever_the_picture)
{
    const struct tracer_options options = {.picture_pixels = 1};
    assert_int_equal(chosen(&options, TRACER_LDC, 100, 2048), 2048);
    assert_int_equal(chosen(&(struct tracer_options){0}, TRACER_LDC, 100, 0), 1024);
}

TEST(a_resolution_that_is_chosen_costs_what_goes_with_the_picture)
{
    const double times = axes_times(device);
    for (uint32_t pixels = AXES_PICTURE_PIXELS_MIN; pixels <= 1u << 21; pixels *= 2) {
        const struct tracer_options options = {.picture_pixels = pixels};
        for (double layers = 1; layers < 20; layers *= 2) {
            const uint32_t resolution = chosen(&options, TRACER_LDC, layers, 0);
            const double samples = layers * 3 * resolution * resolution;
            assert_in_range(resolution, AXES_FITTED_MIN, 1024);
            if (resolution > AXES_FITTED_MIN)
                assert_true(samples <= 4 * times * pixels);
            if (resolution < 1024) /* a fifth of a sample for each texel, and a texel for rounding */
                assert_true(samples > 4 * times * pixels * layers / (layers + AXES_TEXEL_COST) * 0.97);
        }
    }
}

/* Frames of one window, which the user makes a little smaller or larger, must not need another structure. */
TEST(pictures_of_almost_the_same_size_have_the_same_structure)
{
    struct tracer_options options[3] = {0};
    static const uint64_t pixels[] = {1280 * 720, 1400 * 750, 640 * 360};
    for (int i = 0; i < 3; i++)
        tracer_options_note_picture(&options[i], TRACER_LDC, pixels[i]);
    assert_true(tracer_options_same(&options[0], &options[1]));
    assert_false(tracer_options_same(&options[0], &options[2]));
}

TEST(a_chosen_resolution_is_that_of_the_picture_and_warns_only_where_it_is_coarser_than_its_pixels)
{
    for (size_t i = 0; i < 2; i++) {
        struct fixture fixture;
        struct tracer_options options = {0};
        tracer_options_note_picture(&options, sampled[i], 320 * 180);
        fixture_init_by(&fixture, sampled[i], test_scene_spheres(), &options);
        const struct structure_row row = described_row(fixture.tracer, row_of(sampled[i], "static/resolution"));
        if (device->facts.software)
            assert_in_range(row.number, AXES_FITTED_MIN, 1023);
        assert_string_equal(row.warning, "");
        expect_predicted(&fixture, sampled[i], TOLERANCE);
        fixture_finish(&fixture);
    }
}

TEST(a_chosen_resolution_coarser_than_the_pictures_pixels_comes_with_a_warning)
{
    for (size_t i = 0; i < 2 && device->facts.software; i++) {
        struct fixture fixture;
        struct tracer_options options = {0};
        tracer_options_note_picture(&options, sampled[i], 640 * 360);
        fixture_init_by(&fixture, sampled[i], nested_shells(60), &options);
        const struct structure_row row = described_row(fixture.tracer, row_of(sampled[i], "static/resolution"));
        assert_in_range(row.number, AXES_FITTED_MIN, 255);
        assert_non_null(strstr(row.warning, "instead of 256 texels"));
        fixture_finish(&fixture);
    }
}

/* Before there is anything of it. */
TEST(what_is_too_deep_at_any_resolution_is_refused_with_a_remedy)
{
    const struct tracer_options options = options_at(1024);
    for (size_t i = 0; i < 2; i++) {
        struct fixture fixture;
        struct error error = {0};
        fixture_init_by(&fixture, sampled[i], test_scene_create(), &options); /* holds nothing yet */
        add_shells(&fixture.edits, 2000 * (uint32_t)axes_times(device));
        assert_false(try_update(&fixture, &error));
        assert_int_equal(error.kind, ERROR_LIMIT);
        assert_string_equal(error.field, fixture.tracer->impl->name);
        assert_non_null(strstr(error.remedy, "another tracer"));
        assert_in_range(fixture.tracer->stats.device_bytes, 0, 1 << 16);
        fixture_finish(&fixture);
    }
}

/* 10 blocks of the images wide, it touches up to 12: that much less is counted in each. */
TEST(a_stack_is_as_deep_as_it_has_plates)
{
    const struct tracer_options options = options_at(16);
    struct fixture fixture;
    struct test_edits edits = {.scene = test_scene_create()};
    add_stack(&edits, 300, 10.0f / 128);
    test_commit(&edits);
    fixture_init_by(&fixture, TRACER_ABUFFER, edits.scene, &options);
    const struct axes_layers layers = count_layers(&fixture, 0, 0, 1);
    assert_true(layers.greatest > 301.0 * (10 * 10) / (12 * 12) && layers.greatest < 301.5);
    assert_true(layers.mean < 1.5);
    fixture_finish(&fixture);
}

/* Peeling by ldc would take minutes, though the layers are few on average. */
TEST(what_is_too_deep_in_one_place_is_refused_with_a_remedy)
{
    const struct tracer_options options = options_at(1024);
    struct fixture fixture;
    struct error error = {0};
    fixture_init_by(&fixture, TRACER_LDC, test_scene_create(), &options); /* holds nothing yet */
    add_stack(&fixture.edits, 4000, 1.0f / 32);
    assert_false(try_update(&fixture, &error));
    assert_int_equal(error.kind, ERROR_LIMIT);
    assert_non_null(strstr(error.text, "in one place"));
    assert_non_null(strstr(error.remedy, "another tracer"));
    assert_in_range(fixture.tracer->stats.device_bytes, 0, 1 << 16);
    fixture_finish(&fixture);
}
