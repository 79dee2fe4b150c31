/* SPDX-License-Identifier: MIT */
/* Where samples lie and how they add up: the pixel filter against its formula, the device's numbers against the
 * host's, and that a picture does not depend on how its samples were grouped, cut into slices or spread over
 * frames. */
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"

#include "gpu/buffer.h"
#include "render/picture/pixel_filter.h"
#include "render/picture/sequence.h"
#include "shared/bindings.h"
#include "shared/frame.h"
#include "tests/fixtures/shader_probe.h"
#include "tests/harness/test.h"

enum { WIDTH = 48, HEIGHT = 32 };

/* ---- numbers ---- */

static const char twin_text[] = "#include \"shared/bindings.h\"\n"
                                "#include \"common/dispatch.glsl\"\n"
                                "#include \"common/sequence.glsl\"\n"
                                "uniform uint count;\n"
                                "layout(std430, binding = BIND_PASS_0) writeonly buffer b { vec4 values[]; };\n"
                                "void main()\n"
                                "{\n"
                                "    uint i = item_index();\n"
                                "    if (i >= count)\n"
                                "        return;\n"
                                "    uvec2 seed = sequence_seed(uvec2(i * 77u, i & 63u), i >> 3);\n"
                                "    uint index = i * 2654435761u >> (i & 31u);\n"
                                "    values[i] = vec4(sequence_pair(seed, i & 15u, index),\n"
                                "                     sequence_number(seed, i >> 4, index), 0.0);\n"
                                "}\n";

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(the_device_has_the_hosts_numbers_to_the_bit)
{
    struct fixture *fixture = *state;
    enum { COUNT = 4096 };
    static float values[COUNT][4];
    struct error error = {0};
    struct gpu_buffer buffer = {0};
    struct gpu_program program = shader_probe_compile(twin_text, NULL);
    assert_true(gpu_buffer_reserve(fixture->device, &buffer, sizeof(values), &error));
    gpu_uniform_uint(&program, "count", COUNT);
    gpu_buffer_bind_storage(&buffer, BIND_PASS_0);
    gpu_dispatch(fixture->device, &program, COUNT);
    gpu_buffer_read(fixture->device, &buffer, 0, values, sizeof(values));
    assert_true(gpu_check(fixture->device, "twin", &error));
    for (uint32_t i = 0; i < COUNT; i++) {
        struct sequence_seed seed = sequence_seed(i * 77u, i & 63u, i >> 3);
        uint32_t index = i * 2654435761u >> (i & 31u);
        float expected[3];
        sequence_pair(expected, seed, i & 15u, index);
        expected[2] = sequence_number(seed, i >> 4, index);
        assert_memory_equal(values[i], expected, sizeof(expected));
    }
    gpu_buffer_finish(fixture->device, &buffer);
    shader_probe_finish(&program);
}

/* ---- the pixel filter ---- */

/* The left half is black and the right one white, seen straight on; pixels are `step` wide. */
static double an_edge(struct fixture *fixture)
{
    struct scene_material *material = fixture_material(fixture);
    material->value.unlit = true;
    const float right[12] = {1, 0, 0, 50, 0, 1, 0, 0, 0, 0, 1, 0};
    fixture_square(fixture, 50.0f, material->base.id, right);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 3.0f, 1.0f); /* so that there is no default sky */
    fixture->request.picture.width = 16;
    fixture->request.picture.height = 64;
    fixture->request.camera.fov_y = 0.0f;
    fixture->request.camera.ortho_height = 64.0f * 0.1f;
    return 0.1;
}

/* Value of a pixel with its centre `distance` pixels right of the edge. */
static double edge_value(enum pixel_filter filter, double distance)
{
    double share = pixel_filter_share(filter, fabs(distance)) / 2.0;
    return distance < 0.0 ? 0.5 - share : 0.5 + share;
}

TEST(samples_are_as_dense_as_the_filter_is_high)
{
    struct fixture *fixture = *state;
    an_edge(fixture);
    for (enum pixel_filter filter = FILTER_BLACKMAN_HARRIS; filter <= FILTER_BOX; filter++)
        for (int traced = 0; traced < (getenv("FARLIGHT_TEST_LONG") ? 2 : 1); traced++) {
            fixture->request.sampling.pixel_filter = filter;
            fixture->request.tracing.primary = traced ? PRIMARY_TRACE : PRIMARY_RASTER;
            fixture->request.sampling.samples = 256;
            struct frame_result result = fixture_render(fixture);
            double maximum = 0.0;
            for (uint32_t x = 0; x < 16; x++) {
                double mean = 0.0;
                for (uint32_t y = 0; y < 64; y++)
                    mean += (double)fixture_pixel(&result, x, y)[0] / 64.0;
                maximum = fmax(maximum, fabs(mean - edge_value(filter, (double)x - 7.5)));
            }
            print_message("filter %d, %s: off by %.1e at most\n", (int)filter, traced ? "traced" : "rasterised",
                          maximum);
            /* There is a sample in each 256th by x: a mean is off by at most one sample; the table's places
             * by 1/1000 of a pixel, which is at most twice a sample, where the filter is highest. */
            assert_true(maximum <= 1.0 / 256.0 + 0.002);
            frame_result_finish(&result);
        }
}

/* Filters as the protocol describes them, by the formulas, not by pixel_filter.c. */
static double height_of(enum pixel_filter filter, double x)
{
    const double pi = 3.14159265358979;
    if (fabs(x) > pixel_filter_radius(filter))
        return 0.0;
    switch (filter) {
    case FILTER_BLACKMAN_HARRIS: {
        double t = 2.0 * pi * (x + 1.5) / 3.0;
        return 0.35875 - 0.48829 * cos(t) + 0.14128 * cos(2.0 * t) - 0.01168 * cos(3.0 * t);
    }
    case FILTER_GAUSSIAN:
        return exp(-x * x / (2.0 * 0.5 * 0.5));
    case FILTER_TENT:
        return 1.0 - fabs(x);
    case FILTER_BOX:
    case FILTER_COUNT:
        break;
    }
    return 1.0;
}

TEST(the_filters_are_those_of_the_protocol)
{
    static const double radii[] = {1.5, 1.5, 1.0, 0.5};
    for (enum pixel_filter filter = FILTER_BLACKMAN_HARRIS; filter <= FILTER_BOX; filter++) {
        enum { STEPS = 20000 };
        double radius = radii[filter], whole = 0.0, sum = 0.0;
        float places[PIXEL_FILTER_INTERVALS + 1];
        assert_near(pixel_filter_radius(filter), radius, 0.0);
        pixel_filter_places(places, filter);
        for (int i = 0; i < STEPS; i++)
            whole += height_of(filter, radius * (i + 0.5) / STEPS);
        for (int i = 0; i < STEPS; i++) {
            /* the midpoint rule is true to 1e-9 */
            assert_near(pixel_filter_share(filter, radius * i / STEPS), sum / whole, 1e-6);
            /* by the header's formula */
            double number = 0.5 + 0.5 * sum / whole, place = radius * i / STEPS;
            double tolerance = sum / whole < 0.99 ? 1e-3 : sum / whole < 1.0 - 1.0 / 4096.0 ? 5e-3 : radius;
            assert_near(pixel_filter_offset(places, (float)number), place, tolerance);
            assert_near(pixel_filter_offset(places, (float)(1.0 - number)), -place, tolerance);
            sum += height_of(filter, radius * (i + 0.5) / STEPS);
        }
    }
}

/* ---- how samples add up ---- */

/* Glass, gloss, a blended pane and two lights that have a size. */
static void a_mixture(struct fixture *fixture)
{
    struct scene_material *gloss = fixture_material(fixture), *glass = fixture_material(fixture),
                          *pane = fixture_material(fixture), *ground = fixture_material(fixture);
    gloss->value.metallic = 1.0f;
    gloss->value.roughness = 0.3f;
    glass->value.transmission = 1.0f;
    glass->value.ior = 1.5f;
    glass->value.roughness = 0.1f;
    pane->value.alpha_mode = ALPHA_BLEND;
    pane->value.base_colour[3] = 0.4f;
    pane->value.base_colour[0] = 0.2f;
    fixture_sphere(fixture, -0.7f, 0.0f, 0.0f, 0.5f, gloss->base.id);
    fixture_sphere(fixture, 0.7f, 0.0f, 0.2f, 0.5f, glass->base.id);
    const float before[12] = {1, 0, 0, 0, 0, 1, 0, 0.2f, 0, 0, 1, 1.0f},
                behind[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1.5f};
    fixture_square(fixture, 0.4f, pane->base.id, before);
    fixture_square(fixture, 3.0f, ground->base.id, behind);
    fixture_light(fixture, LIGHT_SPHERE, 1.0f, 2.0f, 3.0f, 5.0f);
    fixture_light(fixture, LIGHT_RECTANGLE, -2.0f, 1.0f, 3.0f, 4.0f);
    fixture_environment(fixture, 0.2f, 0.3f, 0.4f);
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.picture.width = WIDTH;
    fixture->request.picture.height = HEIGHT;
    fixture->request.sampling.samples = 21; /* together: 16, 4, 1 */
    fixture->request.sampling.seed = 5;
}

static void assert_same_floats(const struct frame_result *a, const struct frame_result *b)
{
    assert_int_equal(a->size_bytes, b->size_bytes);
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
        for (int c = 0; c < 4; c++)
            if (fixture_pixel(a, i % WIDTH, i / WIDTH)[c] != fixture_pixel(b, i % WIDTH, i / WIDTH)[c])
                fail_msg("pixel %u,%u channel %d: %.9g and %.9g", i % WIDTH, i / WIDTH, c,
                         (double)fixture_pixel(a, i % WIDTH, i / WIDTH)[c],
                         (double)fixture_pixel(b, i % WIDTH, i / WIDTH)[c]);
}

/* Every integrator, each primary way and a lens, in slices of several sizes. Whitted may have more children than
 * parents, which splits a slice; others never have. */
static const struct form {
    const char *name;
    enum integrator_kind integrator;
    enum primary_kind primary;
    float aperture;
} forms[] = {{"whitted", INTEGRATOR_WHITTED, PRIMARY_TRACE, 0.0f},
             {"path", INTEGRATOR_PATH, PRIMARY_TRACE, 0.1f},
             {"distributed", INTEGRATOR_DISTRIBUTED, PRIMARY_RASTER, 0.0f},
             {"ao", INTEGRATOR_AO, PRIMARY_TRACE, 0.0f},
             {"raycast", INTEGRATOR_RAYCAST, PRIMARY_RASTER, 0.0f}};
enum { FORMS = sizeof(forms) / sizeof(forms[0]), FORMS_SHORT = 2 };

static void take_form(struct fixture *fixture, const struct form *form)
{
    print_message("%s\n", form->name);
    fixture->request.light.integrator = form->integrator;
    fixture->request.tracing.primary = form->primary;
    fixture->request.aperture = form->aperture;
}

static void expect_same_in_slices(struct fixture *fixture, const struct form *form)
{
    static const uint32_t slices[] = {1000, 100};
    take_form(fixture, form);
    frame_renderer_set_capacity(fixture->renderer, 0, 0);
    struct frame_result whole = fixture_render(fixture);
    assert_int_equal(whole.samples, 21);
    assert_int_equal(whole.primary_rays, 21 * WIDTH * HEIGHT);
    assert_int_equal(whole.splits, 0);
    for (size_t k = 0; k < sizeof(slices) / sizeof(slices[0]); k++) {
        frame_renderer_set_capacity(fixture->renderer, slices[k], slices[k]);
        struct frame_result cut = fixture_render(fixture);
        assert_same_floats(&whole, &cut);
        assert_int_equal(whole.shadow_rays, cut.shadow_rays);
        assert_int_equal(whole.secondary_rays, cut.secondary_rays);
        assert_true(form->integrator == INTEGRATOR_WHITTED || cut.splits == 0);
        frame_result_finish(&cut);
    }
    frame_renderer_set_capacity(fixture->renderer, 0, 0);
    frame_result_finish(&whole);
}

static void expect_same_in_frames(struct fixture *fixture, const struct form *form)
{
    take_form(fixture, form);
    fixture->request.sampling.samples = 21;
    struct frame_result whole = fixture_render(fixture);
    assert_int_equal(whole.samples, 21);
    fixture->request.sampling.seed++; /* something else in between */
    fixture->request.sampling.samples = 1;
    struct frame_result other = fixture_render(fixture);
    assert_int_equal(other.samples, 1);
    frame_result_finish(&other);
    fixture->request.sampling.seed--;
    uint32_t sum = 0;
    for (uint32_t samples = 1; samples <= 6; samples++) {
        fixture->request.sampling.samples = samples;
        struct frame_result part = fixture_render(fixture);
        sum += samples;
        assert_int_equal(part.samples, sum);
        assert_int_equal(part.primary_rays, samples * WIDTH * HEIGHT);
        if (sum == 21)
            assert_same_floats(&whole, &part);
        frame_result_finish(&part);
    }
    frame_result_finish(&whole);
}

static void expect_same_sums(struct fixture *fixture, const struct form *begin, const struct form *end)
{
    a_mixture(fixture);
    for (const struct form *form = begin; form < end; form++)
        expect_same_in_slices(fixture, form);
    fixture->request.sampling.accumulate = true;
    for (const struct form *form = begin; form < end; form++)
        expect_same_in_frames(fixture, form);
}

TEST(a_picture_is_the_same_to_the_bit_however_its_samples_are_grouped)
{
    expect_same_sums(*state, forms, forms + FORMS_SHORT);
}

TEST_LONG(so_it_is_of_the_other_integrators)
{
    expect_same_sums(*state, forms + FORMS_SHORT, forms + FORMS);
}

/* Where the host waits for the counts of each wave, and on software GL once for each layer that is drawn. */
TEST(rasterised_samples_of_a_pixel_share_their_waves)
{
    struct fixture *fixture = *state;
    const struct scene_material *material = fixture_material(fixture);
    fixture_square(fixture, 3.0f, material->base.id, NULL);
    fixture_light(fixture, LIGHT_SPHERE, 1.0f, 2.0f, 3.0f, 5.0f);
    fixture->request.light.integrator = INTEGRATOR_DISTRIBUTED;
    fixture->request.light.depth = 0;
    uint32_t waits[2];
    for (int i = 0; i < 2; i++) {
        fixture->request.sampling.samples = i ? 16 : 1;
        struct frame_result first = fixture_render(fixture); /* compiles, and brings the scene to the device */
        frame_result_finish(&first);
        struct frame_result result = fixture_render(fixture);
        waits[i] = result.device_waits;
        frame_result_finish(&result);
    }
    if (waits[1] > waits[0] + 15)
        fail_msg("16 samples wait %u times, one %u times", waits[1], waits[0]);
}

TEST(a_slice_of_less_than_a_pixels_samples_is_the_same_picture_too)
{
    struct fixture *fixture = *state;
    a_mixture(fixture);
    fixture->request.aperture = 0.1f;
    fixture->request.picture.width = fixture->request.picture.height = 8;
    for (int i = 0; i < 2; i++) {
        fixture->request.light.integrator = i ? INTEGRATOR_PATH : INTEGRATOR_WHITTED;
        fixture->request.tracing.primary = PRIMARY_TRACE;
        frame_renderer_set_capacity(fixture->renderer, 0, 0);
        struct frame_result whole = fixture_render(fixture);
        frame_renderer_set_capacity(fixture->renderer, 3, 3); /* two samples of one pixel, one of three */
        struct frame_result cut = fixture_render(fixture);
        assert_memory_equal(whole.pixels, cut.pixels, whole.size_bytes);
        frame_result_finish(&whole);
        frame_result_finish(&cut);
    }
}

TEST(a_picture_that_has_all_its_samples_is_handed_out_again)
{
    struct fixture *fixture = *state;
    a_mixture(fixture);
    fixture->request.sampling.accumulate = true;
    fixture->request.sampling.samples = 3;
    fixture->request.samples_max = 5;
    static const uint32_t held[] = {3, 5, 5};
    static const uint64_t traced[] = {3, 2, 0};
    struct frame_result results[3];
    for (int i = 0; i < 3; i++) {
        results[i] = fixture_render(fixture);
        assert_int_equal(results[i].samples, held[i]);
        assert_int_equal(results[i].primary_rays, traced[i] * WIDTH * HEIGHT);
    }
    assert_same_floats(&results[1], &results[2]);
    fixture->request.samples_max = 4; /* more are there than are wanted now */
    struct frame_result fewer = fixture_render(fixture);
    assert_int_equal(fewer.samples, 5);
    assert_same_floats(&results[1], &fewer);
    for (int i = 0; i < 3; i++)
        frame_result_finish(&results[i]);
    frame_result_finish(&fewer);
}

/* Expects that the next frame, after `change` has been undone again, begins without samples. */
static void expect_from_new(struct fixture *fixture, uint32_t samples, const char *what)
{
    struct frame_result result = fixture_render(fixture);
    if (result.samples != samples)
        fail_msg("%s: %u samples, expected %u", what, result.samples, samples);
    frame_result_finish(&result);
}

TEST(what_shows_something_else_begins_from_new)
{
    struct fixture *fixture = *state;
    a_mixture(fixture);
    fixture->request.sampling.accumulate = true;
    fixture->request.sampling.samples = 2;
    const struct frame_request first = fixture->request;
    expect_from_new(fixture, 2, "the first frame");
    expect_from_new(fixture, 4, "the second");
    fixture->request.picture.exposure_stops = 1.0f; /* a change of the display only */
    expect_from_new(fixture, 6, "another exposure");
    fixture->request.camera.world_from_view[3] += 0.01f;
    expect_from_new(fixture, 2, "another camera");
    fixture->request = first;
    expect_from_new(fixture, 2, "back again");
    fixture->request.sampling.pixel_filter = FILTER_BOX;
    expect_from_new(fixture, 2, "another filter");
    fixture->request.aperture = 0.1f;
    expect_from_new(fixture, 2, "another lens");
    fixture->request.light.depth = 2;
    expect_from_new(fixture, 2, "another depth");
    expect_from_new(fixture, 4, "the same");
    fixture_environment(fixture, 0.5f, 0.3f, 0.4f); /* an edit */
    expect_from_new(fixture, 2, "another environment");
    fixture->request.sampling.accumulate = false;
    expect_from_new(fixture, 2, "not asked to go on");
    fixture->request.sampling.accumulate = true;
    expect_from_new(fixture, 2, "after one that was not asked to");
}

TEST(an_abandoned_frame_is_not_gone_on_from)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    struct frame_result dropped = {0};
    a_mixture(fixture);
    fixture->request.sampling.accumulate = true;
    fixture->request.sampling.samples = 2;
    expect_from_new(fixture, 2, "the first frame");
    assert_true(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    for (int i = 0; i < 4; i++)
        assert_int_equal(frame_step(fixture->renderer, &dropped, &error), FRAME_MORE);
    frame_abandon(fixture->renderer);
    expect_from_new(fixture, 2, "the one after it");
}
