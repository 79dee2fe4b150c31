/* SPDX-License-Identifier: MIT */
/* Mirrors, environment, alpha and tone maps against what can be computed by hand. */
#include "tests/accuracy/render_fixture.h"
#include "shared/ray.h"
#include "tests/harness/test.h"

#define PI 3.14159265358979

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(a_mirror_shows_the_colour_of_the_environment)
{
    struct fixture *fixture = *state;
    struct scene_material *material = fixture_material(fixture);
    material->value.metallic = 1.0f;
    material->value.roughness = 0.0f;
    material->value.base_colour[1] = 0.5f;
    fixture_square(fixture, 10.0f, material->base.id, NULL);
    fixture_environment(fixture, 0.2f, 0.4f, 3.0f);
    struct frame_result result = fixture_render(fixture);
    const float *pixel = fixture_pixel(&result, 16, 16);
    /* Schlick at an incidence of one degree is f0 to the last place */
    assert_near(pixel[0], 0.2, 1e-5);
    assert_near(pixel[1], 0.5 * 0.4, 1e-5);
    assert_near(pixel[2], 3.0, 1e-4);
    assert_int_equal(result.secondary_rays, 32 * 32);
    frame_result_finish(&result);
}

/* Half floats of an image whose upper half is 1 and whose lower half is 0. */
TEST(an_environment_image_lights_by_its_irradiance)
{
    struct fixture *fixture = *state;
    enum { WIDTH = 64, HEIGHT = 32 };
    static uint16_t texels[WIDTH * HEIGHT * 4];
    memset(texels, 0, sizeof(texels));
    for (int i = 0; i < WIDTH * HEIGHT / 2 * 4; i++)
        texels[i] = 0x3c00;
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 1.0f, fixture_material(fixture)->base.id);
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    struct scene_environment *environment = &fixture->edits[fixture->edit_count - 1].set.environment;
    environment->value.width = WIDTH;
    environment->value.height = HEIGHT;
    environment->texels = fixture_blob(texels, sizeof(texels));
    fixture->request.camera.fov_y = 0.02f;
    fixture_set_camera(fixture, 0.0f, 0.0f, 5.0f, 0.01f);
    struct frame_result result = fixture_render(fixture);
    /* A surface that looks at the horizon sees half of the sky: exactly 1/2 also to order 2. */
    assert_near(fixture_pixel(&result, 16, 16)[0], 0.5, 0.01);
    frame_result_finish(&result);
    fixture_set_camera(fixture, 0.0f, 5.0f, 0.0f, 0.01f);
    result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 16, 16)[0], 1.0, 0.01);
    frame_result_finish(&result);
    fixture_set_camera(fixture, 0.0f, -5.0f, 0.0f, 0.01f);
    result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 16, 16)[0], 0.0, 0.01);
    frame_result_finish(&result);
}

/* The middle column of the image is -z, columns to its right are towards +x. */
TEST(an_environment_image_stands_the_right_way_round)
{
    struct fixture *fixture = *state;
    enum { WIDTH = 4, HEIGHT = 2 };
    uint16_t texels[WIDTH * HEIGHT * 4] = {0};
    for (int row = 0; row < HEIGHT; row++) {
        texels[(row * WIDTH + 3) * 4 + 0] = 0x3c00; /* red three quarters to the right: +x and behind */
        texels[(row * WIDTH + 2) * 4 + 1] = 0x3c00; /* green: -z to +x */
    }
    for (int i = 0; i < WIDTH; i++)
        texels[i * 4 + 2] = 0x3c00; /* blue above */
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    struct scene_environment *environment = &fixture->edits[fixture->edit_count - 1].set.environment;
    environment->value.width = WIDTH;
    environment->value.height = HEIGHT;
    environment->texels = fixture_blob(texels, sizeof(texels));
    fixture->request.picture.width = fixture->request.picture.height = 9;
    fixture_set_camera(fixture, -3.0f, -3.0f, 3.0f, 0.01f); /* towards +x, +y, -z: the middle of a green column */
    struct frame_result result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 4, 4)[0], 0.0, 0.01);
    assert_near(fixture_pixel(&result, 4, 4)[1], 1.0, 0.01);
    assert_true(fixture_pixel(&result, 4, 4)[2] > 0.6f);
    frame_result_finish(&result);
    fixture_set_camera(fixture, -3.0f, 3.0f, -3.0f, 0.01f); /* towards +x, -y, +z */
    result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 4, 4)[0], 1.0, 0.01);
    assert_true(fixture_pixel(&result, 4, 4)[2] < 0.4f);
    frame_result_finish(&result);
}

TEST(blended_layers_let_through_what_alpha_leaves)
{
    struct fixture *fixture = *state;
    for (int i = 0; i < 3; i++) {
        struct scene_material *material = fixture_material(fixture);
        const float transform[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -0.5f * (float)i};
        material->value.unlit = true;
        material->value.alpha_mode = ALPHA_BLEND;
        material->value.base_colour[3] = 0.25f;
        material->value.base_colour[0] = i == 0 ? 1.0f : 0.0f;
        material->value.base_colour[1] = i == 1 ? 1.0f : 0.0f;
        material->value.base_colour[2] = i == 2 ? 1.0f : 0.0f;
        fixture_square(fixture, 10.0f, material->base.id, transform);
    }
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 9.0f, 1.0f); /* so that there is no default sky */
    fixture->request.light.depth = 0;                            /* going straight on is no bounce */
    struct frame_result result = fixture_render(fixture);
    const float *pixel = fixture_pixel(&result, 16, 16);
    assert_near(pixel[0], 0.25, 1e-6);
    assert_near(pixel[1], 0.75 * 0.25, 1e-6);
    assert_near(pixel[2], 0.75 * 0.75 * 0.25, 1e-6);
    assert_near(pixel[3], 1.0 - 0.75 * 0.75 * 0.75, 1e-6);
    frame_result_finish(&result);
}

/* Behind the camera, between a floor and its light. */
static double light_below_panes(struct fixture *fixture, int count, float transmittance)
{
    fixture_clear((void **)&fixture);
    fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
    struct scene_material *pane = fixture_material(fixture);
    pane->value.alpha_mode = ALPHA_BLEND;
    pane->value.base_colour[3] = 1.0f - transmittance;
    for (int i = 0; i < count; i++) {
        const float transform[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 2.0f + 0.01f * (float)i};
        fixture_square(fixture, 10.0f, pane->base.id, transform);
    }
    fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 9.0f, (float)PI);
    fixture_set_camera(fixture, 0.0f, 0.0f, 1.0f, 0.5f);
    struct frame_result result = fixture_render(fixture);
    const double light = (double)fixture_pixel(&result, 16, 16)[0];
    frame_result_finish(&result);
    return light;
}

TEST(light_through_many_panes_is_the_product_of_their_transmittances)
{
    static const int counts[] = {0, 1, 2, 10, 30};
    for (size_t i = 0; i < sizeof(counts) / sizeof(counts[0]); i++) {
        const double left = pow(0.98, counts[i]);
        /* Half a step of the cube root as which a shadow ray's answer is stored: 0.15 % of all light. */
        const double step = 3.0 * pow(left, 2.0 / 3.0) * 0.5 / VISIBILITY_MAX;
        assert_near(light_below_panes(*state, counts[i], 0.98f), left, step + 1e-5);
    }
}

TEST(depth_counts_the_bounces_after_the_first_hit)
{
    struct fixture *fixture = *state;
    struct scene_material *mirror = fixture_material(fixture);
    mirror->value.metallic = 1.0f;
    mirror->value.roughness = 0.0f;
    mirror->value.emission[0] = 1.0f;
    /* two mirrors face to face, each adding 1: the eye between them sees 1 + depth */
    const float behind[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 20.0f};
    fixture_square(fixture, 100.0f, mirror->base.id, NULL);
    fixture_square(fixture, 100.0f, mirror->base.id, behind);
    fixture->request.camera.fov_y = 0.01f;
    for (uint32_t depth = 0; depth < 9; depth += 4) {
        fixture->request.light.depth = depth;
        struct frame_result result = fixture_render(fixture);
        assert_near(fixture_pixel(&result, 16, 16)[0], 1.0 + depth, 1e-3);
        assert_int_equal(result.secondary_rays, depth * 32 * 32);
        frame_result_finish(&result);
    }
}

static void render_grey(struct fixture *fixture, const float radiance[3], enum tone_map tone_map, uint8_t pixel[4])
{
    fixture_clear((void **)&fixture);
    fixture_environment(fixture, radiance[0], radiance[1], radiance[2]);
    fixture->request.picture.format = PIXEL_FORMAT_RGBA8;
    fixture->request.picture.tone_map = tone_map;
    struct frame_result result = fixture_render(fixture);
    memcpy(pixel, result.pixels, 4);
    frame_result_finish(&result);
}

TEST(tone_maps_have_their_known_values)
{
    /* Computed from the published formulas and rounded to 8-bit sRGB. */
    static const struct {
        float radiance[3];
        enum tone_map tone_map;
        uint8_t expected[3];
    } cases[] = {
        {{0.5f, 0.25f, 1.0f}, TONE_NONE, {188, 137, 255}},     {{2.0f, 0.002f, 0.0f}, TONE_NONE, {255, 7, 0}},
        {{0.5f, 0.5f, 0.5f}, TONE_ACES, {197, 197, 197}},      {{2.0f, 0.2f, 0.1f}, TONE_ACES, {255, 165, 116}},
        {{0.5f, 0.5f, 0.5f}, TONE_NEUTRAL, {181, 181, 181}},   {{4.0f, 4.0f, 4.0f}, TONE_NEUTRAL, {253, 253, 253}},
        {{4.0f, 0.04f, 0.04f}, TONE_NEUTRAL, {253, 150, 150}},
    };
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        uint8_t pixel[4];
        render_grey(*state, cases[i].radiance, cases[i].tone_map, pixel);
        for (int c = 0; c < 3; c++)
            if (abs(pixel[c] - cases[i].expected[c]) > 1)
                fail_msg("case %zu, channel %d: %u, expected %u", i, c, pixel[c], cases[i].expected[c]);
        assert_int_equal(pixel[3], 255);
    }
}

TEST(a_scene_without_any_light_gets_the_default_one)
{
    struct fixture *fixture = *state;
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 1.0f, 0);
    struct frame_result result = fixture_render(fixture);
    assert_true(fixture_pixel(&result, 18, 12)[0] > 0.3f);
    assert_true(fixture_pixel(&result, 1, 1)[2] > 0.3f);
    assert_near(fixture_pixel(&result, 1, 1)[3], 1.0, 0.0);
    assert_true(result.shadow_rays > 0);
    frame_result_finish(&result);
}

TEST(nothing_behind_the_scene_is_transparent)
{
    struct fixture *fixture = *state;
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 0.5f, 0);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 9.0f, 100.0f);
    struct frame_result result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 1, 1)[3], 0.0, 0.0);
    assert_near(fixture_pixel(&result, 16, 16)[3], 1.0, 0.0);
    frame_result_finish(&result);
}
