/* SPDX-License-Identifier: MIT */
/* The integrator `raycast`: parallel layers blend to their closed form, whatever the tracer; lights shine through.
 */
#include "tests/accuracy/render_fixture.h"

#include "shared/path.h"
#include "tests/harness/test.h"

#define PI 3.14159265358979323846
#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

enum { EDGE = 8 };
static const unsigned tracers[] = {TRACER_BVH, TRACER_NAIVE, TRACER_REFERENCE, TRACER_LDC};

/* bvh, or all. */
static size_t tracer_count(void)
{
    return getenv("FARLIGHT_TEST_LONG") ? COUNT(tracers) : 1;
}

static void begin(struct fixture *fixture, unsigned tracer)
{
    fixture_clear((void **)&fixture);
    fixture->request.picture.width = fixture->request.picture.height = EDGE;
    fixture->request.light.integrator = INTEGRATOR_RAYCAST;
    fixture->request.tracing.tracer = tracer;
    fixture->request.tracing.primary = tracer == TRACER_NAIVE ? PRIMARY_RASTER : PRIMARY_TRACE;
    fixture->request.light.depth = 0;                     /* no layer is a bounce */
    fixture->request.tracer_options.ldc.resolution = 256; /* images along z hold planes exactly, however coarse */
}

/* A light that gives nothing keeps the default sky away. */
static void no_light(struct fixture *fixture)
{
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 9.0f, 0.0f);
}

/* From the first one on, away from the eye; returns its material. */
static struct scene_material *a_layer(struct fixture *fixture, uint32_t number, float grey)
{
    const float at[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1.0f - 0.1f * (float)number};
    struct scene_material *material = fixture_material(fixture);
    for (int c = 0; c < 3; c++)
        material->value.base_colour[c] = grey;
    fixture_square(fixture, 3.0f, material->base.id, at);
    return material;
}

static float grey_of(uint32_t layer)
{
    return 0.1f + 0.8f * (float)(layer * 7 % 10) / 10.0f;
}

/* Every pixel of a picture that is the same everywhere. */
static void assert_pixels(struct fixture *fixture, double radiance, double alpha, double tolerance)
{
    struct frame_result result = fixture_render(fixture);
    for (uint32_t i = 0; i < EDGE * EDGE; i++) {
        assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[1], radiance, tolerance);
        assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[3], alpha, tolerance);
    }
    frame_result_finish(&result);
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(layers_are_blended_front_to_back)
{
    struct fixture *fixture = *state;
    static const float opacities[] = {0.0f, 0.2f, 0.9f, 1.0f};
    enum { LAYERS = 5 };
    for (size_t t = 0; t < tracer_count(); t++)
        for (int has_environment = 0; has_environment < 2; has_environment++) {
            begin(fixture, tracers[t]);
            for (uint32_t i = 0; i < LAYERS; i++)
                a_layer(fixture, i, grey_of(i))->value.unlit = true;
            if (has_environment)
                fixture_environment(fixture, 0.3f, 0.3f, 0.3f);
            else
                no_light(fixture);
            for (size_t o = 0; o < COUNT(opacities); o++) {
                double opacity = opacities[o] > 0.0f ? (double)opacities[o] : 0.5, left = 1.0, radiance = 0.0;
                for (uint32_t i = 0; i < LAYERS; i++) {
                    /* surfaces behind less than this share are not there */
                    radiance += left >= (double)PATH_WEIGHT_MIN ? left * opacity * (double)grey_of(i) : 0.0;
                    left = left >= (double)PATH_WEIGHT_MIN ? left * (1.0 - opacity) : 0.0;
                }
                left = left >= (double)PATH_WEIGHT_MIN ? left : 0.0;
                fixture->request.light.layer_opacity = opacities[o];
                /* samples keep colours in eight bits of sRGB */
                assert_pixels(fixture, radiance + (has_environment ? left * (double)0.3f : 0.0),
                              has_environment ? 1.0 : 1.0 - left, tracers[t] == TRACER_LDC ? 0.003 : 1e-5);
            }
        }
}

TEST(faint_layers_go_on_until_nothing_is_left)
{
    struct fixture *fixture = *state;
    enum { LAYERS = 40 };
    double left = 1.0, radiance = 0.0;
    begin(fixture, TRACER_BVH);
    for (uint32_t i = 0; i < LAYERS; i++, left *= 0.95) {
        a_layer(fixture, i, grey_of(i))->value.unlit = true;
        radiance += left * 0.05 * (double)grey_of(i);
    }
    no_light(fixture);
    fixture->request.light.layer_opacity = 0.05f;
    assert_pixels(fixture, radiance, 1.0 - left, 1e-5);
}

TEST(translucent_surfaces_transmit_their_transmittance)
{
    struct fixture *fixture = *state;
    begin(fixture, TRACER_BVH);
    struct scene_material *pane = a_layer(fixture, 0, 0.4f), *glass = a_layer(fixture, 1, 0.8f),
                          *wall = a_layer(fixture, 2, 0.9f);
    pane->value.unlit = glass->value.unlit = wall->value.unlit = true;
    pane->value.alpha_mode = ALPHA_BLEND;
    pane->value.base_colour[3] = 0.25f;
    glass->value.transmission = 0.75f;
    fixture_environment(fixture, 0.5f, 0.5f, 0.5f);
    fixture->request.light.layer_opacity = 0.6f;
    double behind = 0.6 * 0.9 + 0.4 * 0.5;
    double expected = 0.25 * 0.4 + 0.75 * (0.25 * 0.8 + 0.75 * 0.8 * behind);
    struct frame_result result = fixture_render(fixture);
    for (uint32_t i = 0; i < EDGE * EDGE; i++)
        assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[1], expected, 1e-5);
    frame_result_finish(&result);
}

/* Lambert's law for each layer, as if the others were not there; and the environment's irradiance. */
TEST(every_layer_is_lit_without_the_others)
{
    struct fixture *fixture = *state;
    for (size_t t = 0; t < tracer_count(); t++) {
        double radiance = 0.0, left = 1.0;
        begin(fixture, tracers[t]);
        for (uint32_t i = 0; i < 4; i++, left *= 0.5) {
            a_layer(fixture, i, grey_of(i));
            radiance += 0.5 * left * (double)grey_of(i) * (2.0 / PI + (double)0.2f);
        }
        fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, 2.0f);
        fixture_environment(fixture, 0.2f, 0.2f, 0.2f);
        assert_pixels(fixture, radiance + left * (double)0.2f, 1.0, tracers[t] == TRACER_LDC ? 0.003 : 1e-5);
    }
}

TEST(no_shadow_ray_is_traced_and_every_layer_is_one_more)
{
    struct fixture *fixture = *state;
    begin(fixture, TRACER_BVH);
    for (uint32_t i = 0; i < 3; i++)
        a_layer(fixture, i, 0.5f);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 3.0f, 2.0f);
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.shadow_rays, 0);
    assert_int_equal(result.secondary_rays, 3 * EDGE * EDGE);
    frame_result_finish(&result);
    fixture->request.light.layer_opacity = 1.0f;
    result = fixture_render(fixture);
    assert_int_equal(result.secondary_rays, 0);
    frame_result_finish(&result);
}
