/* SPDX-License-Identifier: MIT */
/* `clamp`: what a path brings over a rough surface and one more is limited, and mirrors behind rough surfaces are
 * less sharp; all else stays as it is. */
#include "tests/accuracy/path_fixture.h"
#include "tests/harness/test.h"

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

static const float upright[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

static struct scene_material *a_square(struct fixture *fixture, float half, float x, float z, float facing)
{
    float place[12];
    struct scene_material *material = fixture_material(fixture);
    memcpy(place, upright, sizeof(place));
    place[3] = x;
    place[11] = z;
    place[5] = place[10] = facing;
    fixture_square(fixture, half, material->base.id, place);
    return material;
}

/* With a mask no shadow ray asks for it. A light that gives none keeps the default sky away. */
static struct scene_material *a_lamp(struct fixture *fixture, float half, float x, float z, float radiance)
{
    struct scene_material *glow = a_square(fixture, half, x, z, 1.0f);
    for (int c = 0; c < 3; c++) {
        glow->value.base_colour[c] = 0.0f;
        glow->value.emission[c] = radiance;
    }
    glow->value.alpha_mode = ALPHA_MASK;
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 9.0f, 0.0f);
    return glow;
}

static void begin(struct fixture *fixture, enum integrator_kind integrator, uint32_t depth)
{
    path_begin(fixture, TRACER_REFERENCE, depth);
    fixture->request.light.integrator = integrator;
}

static float *picture(struct fixture *fixture, float clamp, uint32_t samples, uint64_t seed)
{
    float *pixels = malloc(PIXELS * 4 * sizeof(*pixels));
    assert_non_null(pixels);
    fixture->request.light.clamp = clamp;
    fixture->request.sampling.samples = samples;
    fixture->request.sampling.seed = seed;
    struct frame_result result = fixture_render(fixture);
    for (uint32_t i = 0; i < PIXELS; i++)
        memcpy(pixels + (size_t)4 * i, fixture_pixel(&result, i % EDGE, i / EDGE), 4 * sizeof(*pixels));
    frame_result_finish(&result);
    return pixels;
}

struct summary {
    double mean, deviation, most;
};

static struct summary summary_of(struct fixture *fixture, float clamp, uint32_t samples)
{
    float *pixels = picture(fixture, clamp, samples, 3);
    struct summary summary = {0};
    double squares = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        const double value = (double)pixels[4 * i + 1];
        summary.mean += value / PIXELS;
        squares += value * value / PIXELS;
        summary.most = fmax(summary.most, value);
    }
    summary.deviation = sqrt(squares - summary.mean * summary.mean);
    free(pixels);
    return summary;
}

/* A floor below a lamp that shines on it and on a ceiling: sharp mirrors, and rough ones that see the lamp. */
TEST(what_one_rough_surface_or_smooth_ones_scatter_stays_to_the_byte)
{
    struct fixture *fixture = *state;
    static const enum integrator_kind integrators[] = {INTEGRATOR_PATH, INTEGRATOR_DISTRIBUTED,
                                                       INTEGRATOR_WHITTED};
    for (size_t i = 0; i < COUNT(integrators); i++)
        for (int smooth = 0; smooth < 2; smooth++) {
            begin(fixture, integrators[i], smooth ? 4 : 1);
            struct scene_material *floor = a_square(fixture, 2.0f, 0.0f, 0.0f, 1.0f),
                                  *ceiling = a_square(fixture, 2.0f, 1.0f, 3.0f, -1.0f);
            floor->value.metallic = ceiling->value.metallic = smooth ? 1.0f : 0.5f;
            floor->value.roughness = ceiling->value.roughness = smooth ? 0.0f : 0.4f;
            a_lamp(fixture, 0.2f, 0.0f, 2.0f, 1000.0f);
            fixture_set_camera(fixture, 0.5f, -2.5f, 2.0f, 0.8f);
            float *off = picture(fixture, 0.0f, 4, 1), *on = picture(fixture, 1.0f, 4, 1);
            float most = 0.0f;
            for (uint32_t k = 0; k < PIXELS; k++)
                most = fmaxf(most, off[4 * k + 1]);
            assert_memory_equal(off, on, PIXELS * 4 * sizeof(*off));
            assert_true(integrators[i] == INTEGRATOR_WHITTED || most > 100.0f); /* else nothing is shown */
            free(off);
            free(on);
        }
}

/* A floor and a ceiling, and between them a plate that hides the lamp on it from the floor: of a path that brings
 * light of it to the floor there is one such contribution, as the lamp is black. */
TEST(a_sample_brings_no_more_than_the_limit)
{
    struct fixture *fixture = *state;
    begin(fixture, INTEGRATOR_PATH, 4);
    a_square(fixture, 2.0f, 0.0f, 0.0f, 1.0f);
    a_square(fixture, 2.0f, 0.0f, 2.0f, -1.0f);
    a_square(fixture, 0.6f, 0.0f, 1.2f, -1.0f);
    a_lamp(fixture, 0.1f, 0.0f, 1.21f, 1000.0f);
    fixture_set_camera(fixture, 1.2f, 0.3f, 0.5f, 0.8f);
    const struct summary off = summary_of(fixture, 0.0f, 4), on = summary_of(fixture, 2.0f, 4);
    fixture->request.picture.exposure_stops = 1.0f; /* the limit is that of the picture's values */
    const struct summary exposed = summary_of(fixture, 4.0f, 4);
    print_message("maximum %.3f, limited %.3f; mean %.4f, limited %.4f\n", off.most, on.most, off.mean, on.mean);
    assert_true(off.most > 10.0);
    assert_true(on.most <= 2.0 + 1e-5 && on.most > 0.0 && on.mean < off.mean);
    assert_true(fabs(exposed.most - 2.0 * on.most) <= 1e-5);
}

/* An emissive square a centimetre above a floor, which shadow rays alone find: as they are spread over its solid
 * angle, at most half a sphere, and one of its two triangles is chosen, a sample brings at most 2 x 2 times its
 * radiance. */
TEST(a_lamp_that_nearly_touches_a_surface_makes_no_specks)
{
    struct fixture *fixture = *state;
    begin(fixture, INTEGRATOR_DISTRIBUTED, 1);
    a_square(fixture, 2.0f, 0.0f, 0.0f, 1.0f);
    a_lamp(fixture, 0.3f, 0.0f, 0.01f, 1.0f)->value.alpha_mode = ALPHA_OPAQUE;
    fixture_set_camera(fixture, 1.0f, 0.2f, 0.5f, 0.6f);
    const struct summary off = summary_of(fixture, 0.0f, 4), on = summary_of(fixture, 10.0f, 4);
    print_message("maximum %.3f, mean %.4f\n", off.most, off.mean);
    assert_true(off.most <= 4.0 && off.mean > 0.1);
    assert_true(on.most == off.most && on.mean == off.mean); /* there is nothing to be limited */
}

/* The noise of a picture: by its mean, of two that differ in nothing else. */
static double noise_of(struct fixture *fixture, float clamp, uint32_t samples, double *mean)
{
    float *pictures[2];
    double squares = 0.0;
    *mean = 0.0;
    for (uint64_t i = 0; i < 2; i++)
        pictures[i] = picture(fixture, clamp, samples, i);
    for (uint32_t i = 1; i < 4 * PIXELS; i += 4) {
        squares += (double)(pictures[0][i] - pictures[1][i]) * (double)(pictures[0][i] - pictures[1][i]);
        *mean += (double)(pictures[0][i] + pictures[1][i]) / (2 * PIXELS);
    }
    for (uint64_t i = 0; i < 2; i++)
        free(pictures[i]);
    return sqrt(squares / (2 * PIXELS)) / *mean;
}

/* Paths from a floor find a small light, which a plate hides from it, by way of a mirror above both. A rougher
 * mirror sends the floor as much light in all, as both are large, but to other places. */
TEST_LONG(mirrors_behind_rough_surfaces_cast_their_light_with_less_noise)
{
    struct fixture *fixture = *state;
    double means[2], mean;
    begin(fixture, INTEGRATOR_PATH, 2);
    a_square(fixture, 30.0f, 0.0f, 0.0f, 1.0f);
    struct scene_material *mirror = a_square(fixture, 30.0f, 0.0f, 2.0f, -1.0f);
    mirror->value.metallic = 1.0f;
    mirror->value.roughness = 0.0f;
    struct scene_material *plate = a_square(fixture, 0.5f, 0.0f, 0.9f, -1.0f);
    plate->value.base_colour[0] = plate->value.base_colour[1] = plate->value.base_colour[2] = 0.0f;
    struct scene_light *light = fixture_light(fixture, LIGHT_SPHERE, 0.0f, 0.0f, 1.0f, 100.0f);
    light->value.size[0] = 0.05f;
    fixture_set_camera(fixture, 0.0f, 0.0f, 0.8f, 0.0f);
    fixture->request.camera.ortho_height = 6.0f;
    const double sharp = noise_of(fixture, 0.0f, 64, &mean), blurred = noise_of(fixture, 1e6f, 64, &means[1]);
    noise_of(fixture, 0.0f, 1024, &means[0]);
    print_message("noise %.3f, regularised %.3f; mean %.4f, regularised %.4f\n", sharp, blurred, means[0],
                  means[1]);
    assert_true(blurred < 0.25 * sharp);
    assert_near(means[1], means[0], 0.2 * means[0]);
}
