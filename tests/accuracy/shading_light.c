/* SPDX-License-Identifier: MIT */
/* Shading against what can be computed by hand. */
#include "tests/accuracy/render_fixture.h"

#include "shared/path.h"
#include "tests/harness/test.h"

#define PI 3.14159265358979

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(point_light_falls_with_the_inverse_square_and_the_cosine)
{
    struct fixture *fixture = *state;
    const float height = 2.0f, power = 7.0f;
    fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, height, power);
    struct frame_result result = fixture_render(fixture);
    double half = tan(0.3) * 5.0;
    for (uint32_t x = 0; x < 32; x += 5) {
        double place_x = ((x + 0.5) / 32 * 2 - 1) * half, place_y = (1 - (16 + 0.5) / 32 * 2) * half;
        double squared = place_x * place_x + place_y * place_y + height * height;
        double expected = power / squared * (height / sqrt(squared)) / PI;
        assert_near(fixture_pixel(&result, x, 16)[0], expected, expected * 1e-3);
    }
    frame_result_finish(&result);
}

/* Straight below, over distances 1 .. 512: a millionth of the light is as exact as all of it. */
TEST(point_light_falls_with_the_inverse_square_over_any_distance)
{
    struct fixture *fixture = *state;
    for (float height = 1.0f; height <= 512.0f; height *= 2.0f) {
        fixture_clear(state);
        fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
        fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, height, 7.0f);
        fixture->request.camera.fov_y = 1e-4f;
        struct frame_result result = fixture_render(fixture);
        /* gathered that share of the eye's distance above the plane */
        double distance = (double)height - 5.0 * (double)PATH_OFFSET, expected = 7.0 / (distance * distance) / PI;
        assert_near(fixture_pixel(&result, 16, 16)[0], expected, expected * 2e-6); /* some ten roundings */
        frame_result_finish(&result);
    }
}

TEST(a_light_beyond_its_range_is_dark)
{
    struct fixture *fixture = *state;
    fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
    struct scene_light *light = fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 2.0f, 7.0f);
    light->range = 1.5f;
    struct frame_result result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 16, 16)[1], 0.0, 0.0);
    frame_result_finish(&result);
}

TEST(directional_light_gives_irradiance_over_pi)
{
    struct fixture *fixture = *state;
    struct scene_material *material = fixture_material(fixture);
    material->base_colour[0] = 0.5f;
    fixture_square(fixture, 10.0f, material->base.id, NULL);
    fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, 3.0f);
    struct frame_result result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 7, 20)[0], 0.5 * 3.0 / PI, 2e-4);
    assert_near(fixture_pixel(&result, 7, 20)[1], 3.0 / PI, 2e-4);
    assert_near(fixture_pixel(&result, 7, 20)[3], 1.0, 0.0);
    frame_result_finish(&result);
}

TEST(directional_light_falls_with_the_cosine)
{
    struct fixture *fixture = *state;
    for (double slant = 0.0; slant < 1.9; slant += 0.2) {
        fixture_clear(state);
        fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
        fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, 3.0f);
        float c = (float)cos(slant), s = (float)sin(slant);
        const float turn[12] = {c, 0, s, 0, 0, 1, 0, 0, -s, 0, c, 0};
        memcpy(fixture->edits[fixture->edit_count - 1].set.node.parent_from_node, turn, sizeof(turn));
        struct frame_result result = fixture_render(fixture);
        assert_near(fixture_pixel(&result, 7, 20)[0], 3.0 * fmax(cos(slant), 0.0) / PI,
                    1e-6); /* some ten roundings */
        frame_result_finish(&result);
    }
}

/* KHR_lights_punctual: between the cones the square of how far the cosine has come. */
TEST(spot_light_fades_between_its_cones)
{
    struct fixture *fixture = *state;
    fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
    struct scene_light *light = fixture_light(fixture, LIGHT_SPOT, 0.0f, 0.0f, 2.0f, 4.0f);
    light->inner_cone = 0.2f;
    light->outer_cone = 0.6f;
    struct frame_result result = fixture_render(fixture);
    double half = tan(0.3) * 5.0, place_y = (1 - (16 + 0.5) / 32 * 2) * half;
    for (uint32_t x = 0; x < 32; x++) {
        double place_x = ((x + 0.5) / 32 * 2 - 1) * half;
        double squared = place_x * place_x + place_y * place_y + 4.0, cosine = 2.0 / sqrt(squared);
        double way = fmin(fmax((cosine - cos(0.6)) / (cos(0.2) - cos(0.6)), 0.0), 1.0);
        /* gathered 8e-5 above the plane, which is 4e-5 of the height: some times that, as 4 / squared * cosine is
         * of third order and the way across the cone six times steeper */
        assert_near(fixture_pixel(&result, x, 16)[0], 4.0 / squared * cosine * way * way / PI, 3e-4);
    }
    frame_result_finish(&result);
}

TEST(spot_light_ends_at_its_outer_cone)
{
    struct fixture *fixture = *state;
    fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
    struct scene_light *light = fixture_light(fixture, LIGHT_SPOT, 0.0f, 0.0f, 2.0f, 4.0f);
    light->inner_cone = 0.2f;
    light->outer_cone = 0.4f;
    struct frame_result result = fixture_render(fixture);
    double middle = (0.5 / 16) * tan(0.3) * 5.0, squared = 2 * middle * middle + 4.0;
    assert_near(fixture_pixel(&result, 16, 16)[0], 4.0 / squared * (2.0 / sqrt(squared)) / PI, 1e-3);
    /* 1.45 from the axis at the picture's edge: an angle of 0.63 */
    assert_near(fixture_pixel(&result, 0, 16)[0], 0.0, 0.0);
    frame_result_finish(&result);
}

/* The form factor of a point to a parallel rectangle above its corner, four times. */
static double irradiance_under_square(double half, double height)
{
    double a = half / height;
    double s = a / sqrt(1 + a * a);
    return 4.0 * s * atan(s);
}

TEST(rectangle_light_converges_to_its_form_factor)
{
    struct fixture *fixture = *state;
    fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
    struct scene_light *light = fixture_light(fixture, LIGHT_RECTANGLE, 0.0f, 0.0f, 1.5f, 2.0f);
    light->size[0] = light->size[1] = 1.0f;
    fixture->request.samples = 256;
    fixture->request.width = fixture->request.height = 8;
    fixture->request.camera.fov_y = 0.02f;
    struct frame_result result = fixture_render(fixture);
    double expected = 2.0 * irradiance_under_square(0.5, 1.5) / PI;
    for (uint32_t x = 0; x < 8; x++)
        assert_near(fixture_pixel(&result, x, 4)[0], expected, expected * 0.01);
    frame_result_finish(&result);
}

TEST(sphere_light_shines_like_its_solid_angle)
{
    struct fixture *fixture = *state;
    fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
    struct scene_light *light = fixture_light(fixture, LIGHT_SPHERE, 0.0f, 0.0f, 1.5f, 2.0f);
    light->size[0] = 0.75f;
    fixture->request.samples = 256;
    fixture->request.width = fixture->request.height = 8;
    fixture->request.camera.fov_y = 0.02f;
    struct frame_result result = fixture_render(fixture);
    double expected = 2.0 * PI * 0.25 / PI; /* radiance times pi sin^2 of the half angle */
    for (uint32_t x = 0; x < 8; x++)
        assert_near(fixture_pixel(&result, x, 4)[0], expected, expected * 0.01);
    frame_result_finish(&result);
}

/* pi L (r / d)^2 cos, wherever it stands above the horizon. */
TEST(sphere_light_shines_with_the_square_of_its_apparent_size_and_the_cosine)
{
    static const double places[][3] = {/* x, z, radius */
                                       {0.5, 1.0, 0.3},
                                       {2.0, 1.0, 0.3},
                                       {3.0, 0.5, 0.4},
                                       {0.0, 50.0, 5.0},
                                       {30.0, 40.0, 0.01}};
    struct fixture *fixture = *state;
    for (size_t i = 0; i < sizeof(places) / sizeof(places[0]); i++) {
        fixture_clear(state);
        double x = places[i][0], z = places[i][1], r = places[i][2], squared = x * x + z * z;
        fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
        fixture_light(fixture, LIGHT_SPHERE, (float)x, 0.0f, (float)z, 2.0f)->size[0] = (float)r;
        fixture->request.samples = 64;
        fixture->request.camera.fov_y = 1e-4f;
        struct frame_result result = fixture_render(fixture);
        double expected = 2.0 * PI * r * r / squared * z / sqrt(squared) / PI, sum = 0.0;
        for (uint32_t k = 0; k < 32 * 32; k++)
            sum += (double)fixture_pixel(&result, k % 32, k / 32)[0] / (32 * 32);
        print_message("sphere light %zu: off by %+.1e\n", i, sum / expected - 1.0);
        /* gathered 8e-5 above the plane, of a z of at least 0.5; the mean of 65536 samples that differ by less
         * than their mean has a standard error below 0.004, and of a lattice a tenth of that */
        assert_near(sum, expected, expected * 1e-3);
        frame_result_finish(&result);
    }
}

TEST(a_sphere_between_light_and_plane_casts_a_shadow)
{
    struct fixture *fixture = *state;
    uint32_t material = fixture_material(fixture)->base.id;
    fixture_square(fixture, 10.0f, material, NULL);
    fixture_sphere(fixture, 3.0f, 0.0f, 2.0f, 0.5f, material);
    const float towards_light[3] = {3.0f, 0.0f, 4.0f};
    fixture_light(fixture, LIGHT_POINT, towards_light[0] * 2, towards_light[1], towards_light[2], 20.0f);
    /* from (6, 0, 4) through (3, 0, 2) to the origin */
    struct frame_result result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 16, 16)[0], 0.0, 0.0);
    assert_true(fixture_pixel(&result, 16, 1)[0] > 0.01f);
    frame_result_finish(&result);
}

TEST(many_lights_are_shaded_in_batches)
{
    struct fixture *fixture = *state;
    fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
    for (int i = 0; i < 23; i++)
        fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, 0.25f);
    frame_renderer_set_capacity(fixture->renderer, 1024, 1024); /* two lights a batch */
    struct frame_result result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 9, 9)[2], 23 * 0.25 / PI, 1e-3);
    assert_int_equal(result.shadow_rays, 23 * 32 * 32);
    frame_result_finish(&result);
}
