/* SPDX-License-Identifier: MIT */
/* Smooth glass: what it mirrors, where it sends what it refracts, and how the two go on. */
#include "tests/accuracy/render_fixture.h"

#include "shared/path.h"
#include "tests/harness/test.h"

#define PI 3.14159265358979
/* 16-bit normals are off by up to 3e-5; float arithmetic is far below that. */
#define NORMAL_TOLERANCE 2e-4

static double fresnel(double cosine, double n)
{
    double sine = sqrt(1.0 - cosine * cosine), bent = sqrt(1.0 - sine * sine / (n * n));
    double s = (cosine - n * bent) / (cosine + n * bent), p = (n * cosine - bent) / (n * cosine + bent);
    return (s * s + p * p) / 2.0;
}

static struct scene_material *clear_glass(struct fixture *fixture, double ior)
{
    struct scene_material *glass = fixture_material(fixture);
    glass->value.ior = (float)ior;
    glass->value.roughness = 0.0f;
    glass->value.transmission = 1.0f;
    return glass;
}

static uint32_t light_material(struct fixture *fixture)
{
    struct scene_material *light = fixture_material(fixture);
    light->value.unlit = true;
    return light->base.id;
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(glass_reflects_four_percent_at_normal_incidence)
{
    struct fixture *fixture = *state;
    struct scene_material *glass = clear_glass(fixture, 1.5);
    /* refracts nothing, so that all that arrives is what it reflects */
    glass->value.base_colour[0] = glass->value.base_colour[1] = glass->value.base_colour[2] = 0.0f;
    fixture_square(fixture, 10.0f, glass->base.id, NULL);
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    fixture->request.camera.fov_y = 0.01f;
    struct frame_result result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 16, 16)[0], 0.04, 1e-5);
    frame_result_finish(&result);
}

TEST(glass_at_a_slant_follows_fresnels_equations)
{
    struct fixture *fixture = *state;
    struct scene_material *glass = clear_glass(fixture, 1.5);
    glass->value.base_colour[0] = glass->value.base_colour[1] = glass->value.base_colour[2] = 0.0f;
    fixture_square(fixture, 100.0f, glass->base.id, NULL);
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    fixture->request.picture.width = fixture->request.picture.height = 9;
    fixture_set_camera(fixture, 5.0f * (float)sin(1.2), 0.0f, 5.0f * (float)cos(1.2), 0.01f);
    struct frame_result result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 4, 4)[0], fresnel(cos(1.2), 1.5), NORMAL_TOLERANCE);
    frame_result_finish(&result);
}

/* KHR_materials_specular: the curve begins at 4 % times the colour, ends at 1, and all of it is halved. */
TEST(a_mirror_may_be_weaker_and_coloured)
{
    struct fixture *fixture = *state;
    static const float colour[3] = {2.0f, 1.0f, 0.25f};
    for (int slant = 0; slant < 3; slant++) {
        double angle = 0.7 * slant;
        fixture_clear(state);
        struct scene_material *glass = clear_glass(fixture, 1.5);
        glass->value.base_colour[0] = glass->value.base_colour[1] = glass->value.base_colour[2] = 0.0f;
        glass->value.specular = 0.5f;
        memcpy(glass->value.specular_colour, colour, sizeof(colour));
        fixture_square(fixture, 100.0f, glass->base.id, NULL);
        fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
        fixture->request.picture.width = fixture->request.picture.height = 9;
        fixture_set_camera(fixture, 5.0f * (float)sin(angle), 0.0f, 5.0f * (float)cos(angle), 0.01f);
        struct frame_result result = fixture_render(fixture);
        double rise = (fresnel(cos(angle), 1.5) - 0.04) / 0.96;
        for (int channel = 0; channel < 3; channel++) {
            double begins = 0.04 * (double)colour[channel];
            assert_near(fixture_pixel(&result, 4, 4)[channel], 0.5 * (begins + (1.0 - begins) * rise),
                        NORMAL_TOLERANCE);
        }
        frame_result_finish(&result);
    }
}

/* A pane that neither mirrors nor bends, in a white world: what is left of the light is by the way through it. */
TEST(a_body_takes_light_by_the_way_through_it)
{
    static const float turned[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -0.5f};
    static const unsigned integrators[] = {INTEGRATOR_WHITTED, INTEGRATOR_DISTRIBUTED, INTEGRATOR_PATH};
    static const float left[3] = {0.5f, 0.8f, 1.0f}; /* after 0.7 m */
    struct fixture *fixture = *state;
    for (int i = 0; i < 3; i++)
        for (int slant = 0; slant < 90; slant += 40) {
            double angle = slant * PI / 180.0;
            fixture_clear(state);
            struct scene_material *smoke = clear_glass(fixture, 1.0);
            smoke->value.attenuation_distance = 0.7f;
            memcpy(smoke->value.attenuation_colour, left, sizeof(left));
            fixture_square(fixture, 1000.0f, smoke->base.id, NULL);
            fixture_square(fixture, 1000.0f, smoke->base.id, turned);
            fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
            fixture->request.light.integrator = integrators[i];
            fixture->request.picture.width = fixture->request.picture.height = 3;
            fixture_set_camera(fixture, (float)(5.0 * sin(angle)), 0.0f, (float)(5.0 * cos(angle)), 0.001f);
            struct frame_result result = fixture_render(fixture);
            for (int channel = 0; channel < 3; channel++)
                /* a pixel's half is 1.7e-4 of the angle, whose tangent is up to 6 */
                assert_near(fixture_pixel(&result, 1, 1)[channel],
                            pow((double)left[channel], 0.5 / cos(angle) / 0.7), 2e-3);
            frame_result_finish(&result);
        }
}

/* A pane between the light and what is seen. */
static float lit_through(struct fixture *fixture, float metallic, bool has_texture)
{
    static const float above[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 2},
                       down[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 3};
    static const uint8_t no_metal[4] = {255, 255, 0, 255};
    fixture_clear((void **)&fixture);
    struct scene_texture *texture = &fixture_edit(fixture, OBJECT_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->value.width = texture->value.height = 1;
    texture->value.format = TEXTURE_RGBA8_LINEAR;
    texture->texels = fixture_blob(no_metal, sizeof(no_metal));
    const struct record_texture_use use = {
        .texture = texture->base.id, .uv_transform = {1, 0, 0, 0, 1, 0}, .strength = 1.0f};
    struct scene_material *glass = clear_glass(fixture, 1.5);
    glass->value.metallic = metallic;
    if (has_texture)
        glass->textures[MATERIAL_METALLIC_ROUGHNESS] = use;
    fixture_square(fixture, 10.0f, glass->base.id, above);
    fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
    struct scene_light *light = &fixture_edit(fixture, OBJECT_LIGHT)->set.light;
    light->base.id = fixture->next_id++;
    light->value.kind = LIGHT_DIRECTIONAL;
    light->value.colour[0] = light->value.colour[1] = light->value.colour[2] = (float)PI;
    fixture_node(fixture, NODE_LIGHT, light->base.id, down);
    fixture->request.light.integrator = INTEGRATOR_WHITTED;
    fixture_set_camera(fixture, 0.0f, 0.0f, 1.0f, 0.5f);
    struct frame_result result = fixture_render(fixture);
    const float value = fixture_pixel(&result, 16, 16)[0];
    frame_result_finish(&result);
    return value;
}

TEST(light_passes_glass_whose_texture_says_that_it_is_no_metal)
{
    const float clear = lit_through(*state, 0.0f, false);
    assert_true(clear > 0.5f);
    assert_near(lit_through(*state, 1.0f, true), clear, 1e-6);
    assert_near(lit_through(*state, 1.0f, false), 0.0, 1e-6);
}

TEST(light_is_totally_reflected_inside_glass)
{
    struct fixture *fixture = *state;
    struct scene_material *glass = clear_glass(fixture, 1.5);
    fixture_square(fixture, 100.0f, glass->base.id, NULL);
    fixture_environment(fixture, 1.0f, 0.5f, 0.25f);
    fixture->request.picture.width = fixture->request.picture.height = 9;
    /* from behind the square, which is inside; the critical angle is 41.8 degrees */
    fixture_set_camera(fixture, 5.0f * (float)sin(0.9), 0.0f, -5.0f * (float)cos(0.9), 0.01f);
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.secondary_rays, 9 * 9);
    assert_near(fixture_pixel(&result, 4, 4)[1], 0.5, 1e-5);
    frame_result_finish(&result);
    fixture_set_camera(fixture, 5.0f * (float)sin(0.5), 0.0f, -5.0f * (float)cos(0.5), 0.01f);
    result = fixture_render(fixture);
    assert_int_equal(result.secondary_rays, 2 * 9 * 9);
    frame_result_finish(&result);
}

/* A scene in which nothing shines gets a sky; this is far too little to be seen. */
static void no_sky(struct fixture *fixture)
{
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 900.0f, 1e-9f);
}

/* The eye looks at the boundary under `before`; a light of 0.1 degrees stands where the ray should go, and nothing
 * else shines. `side`: of the eye, -1 inside. What the light brings is what the boundary lets through. */
static void expect_bent(struct fixture *fixture, double n, double before, double after, int side)
{
    fixture_clear((void **)&fixture);
    fixture_square(fixture, 100.0f, clear_glass(fixture, n)->base.id, NULL);
    double x = -2.0 * sin(after), z = -2.0 * side * cos(after);
    fixture_sphere(fixture, (float)x, 0.0f, (float)z, 0.0035f, light_material(fixture));
    no_sky(fixture);
    fixture->request.picture.width = fixture->request.picture.height = 9;
    fixture_set_camera(fixture, (float)(4.0 * sin(before)), 0.0f, (float)(4.0 * side * cos(before)), 0.001f);
    struct frame_result result = fixture_render(fixture);
    double share = 1.0 - fresnel(cos(side > 0 ? before : after), n);
    assert_near(fixture_pixel(&result, 4, 4)[0], share, 1e-5); /* float, at slopes of Fresnel's curve up to 10 */
    frame_result_finish(&result);
}

TEST(refraction_obeys_snells_law)
{
    static const double indices[] = {1.1, 1.33, 1.5, 2.4};
    for (int i = 0; i < 4; i++)
        for (double outside = 0.1; outside < 1.5; outside += 0.2) {
            double inside = asin(sin(outside) / indices[i]);
            expect_bent(*state, indices[i], outside, inside, 1);
            expect_bent(*state, indices[i], inside, outside, -1);
        }
}

/* Share of a light's radiance of 1 that a pane of clear glass transmits (bounces = 2, 4, ..) or reflects (1,
 * 3, ..), if its walls mirror the share f each time, over the bounces that are followed and paths that carry
 * enough. */
static double pane_series(double f, uint32_t depth, bool through)
{
    const double weight_min = (double)PATH_WEIGHT_MIN;
    double sum = !through && depth > 0 && f >= weight_min ? f : 0.0, inside = 1.0 - f;
    for (uint32_t bounces = 2; bounces <= depth && inside >= weight_min; bounces++) {
        bool behind = bounces % 2 == 0;
        if (behind == through && inside * (1.0 - f) >= weight_min)
            sum += inside * (1.0 - f);
        inside *= f;
    }
    return sum;
}

TEST(a_pane_of_glass_shares_light_out_as_the_series_of_its_reflections)
{
    static const float turned[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -0.5f};
    struct fixture *fixture = *state;
    double worst = 0.0;
    for (int through = 0; through < 2; through++)
        for (int slant = 0; slant < 90; slant += 20)
            for (uint32_t depth = 0; depth <= 8; depth++) {
                fixture_clear(state);
                uint32_t glass = clear_glass(fixture, 2.4)->base.id;
                const float light[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, through ? -2.0f : 7.0f};
                fixture_square(fixture, 1000.0f, glass, NULL);
                fixture_square(fixture, 1000.0f, glass, turned);
                fixture_square(fixture, 1000.0f, light_material(fixture), light);
                no_sky(fixture);
                fixture->request.picture.width = fixture->request.picture.height = 3;
                fixture->request.light.depth = depth;
                double angle = slant * PI / 180.0;
                fixture_set_camera(fixture, (float)(5.0 * sin(angle)), 0.0f, (float)(5.0 * cos(angle)), 0.001f);
                struct frame_result result = fixture_render(fixture);
                double expected = pane_series(fresnel(cos(angle), 2.4), depth, through);
                worst = fmax(worst, fabs((double)fixture_pixel(&result, 1, 1)[0] - expected));
                frame_result_finish(&result);
            }
    print_message("a pane of glass, up to 8 bounces: off by %.1e\n", worst);
    assert_true(worst < 1e-5); /* a few roundings at each wall */
}
