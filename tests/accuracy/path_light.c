/* SPDX-License-Identifier: MIT */
/* The integrator `path` and its lights: against closed forms, with light found by shadow rays alone, by the rays
 * that go on alone, and by both; and where glass lies between.
 *
 * A path without bounces has shadow rays alone, and one more bounce above a floor adds nothing but the other way
 * to find the same light. A square that glows is found both ways, too; with a mask, that cuts nothing out, it has
 * no shadow rays at all. */
#include "tests/accuracy/path_fixture.h"
#include "tests/harness/test.h"

#define HEIGHT 2.0f /* of the lights above the floor */
#define HALF 0.5f   /* of the rectangle's edges, and the ball's radius */
#define VIEW 4.0f   /* metres of the floor that are seen */

/* Looks down at the floor z = 0 from under the roof, if there is one. */
static struct scene_material *a_floor(struct fixture *fixture, float eye_height)
{
    struct scene_material *material = fixture_material(fixture);
    fixture_square(fixture, 50.0f, material->base.id, NULL);
    fixture_look(fixture, 0.0f, 0.0f, eye_height, 0.0f);
    fixture->request.camera.ortho_height = VIEW;
    return material;
}

static void place_of(uint32_t pixel, double place[2])
{
    place[0] = ((pixel % EDGE + 0.5) / EDGE - 0.5) * (double)VIEW;
    place[1] = (0.5 - (pixel / EDGE + 0.5) / EDGE) * (double)VIEW;
}

/* Irradiance by pi at a place of the floor of a rectangle of radiance 1 that looks down at it: Lambert's sum over
 * its edges, each the angle under which it is seen times how the plane through it stands to the floor. */
static double below_a_rectangle(const double place[2])
{
    static const double corners[4][2] = {{-1, -1}, {-1, 1}, {1, 1}, {1, -1}};
    double sum = 0.0;
    for (int i = 0; i < 4; i++) {
        double a[3], b[3], across[3], dot = 0.0, length = 0.0, aa = 0.0, bb = 0.0;
        for (int k = 0; k < 2; k++) {
            a[k] = corners[i][k] * (double)HALF - place[k];
            b[k] = corners[(i + 1) % 4][k] * (double)HALF - place[k];
        }
        a[2] = b[2] = (double)HEIGHT;
        for (int k = 0; k < 3; k++) {
            across[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
            dot += a[k] * b[k];
            aa += a[k] * a[k];
            bb += b[k] * b[k];
            length += across[k] * across[k];
        }
        sum += acos(dot / sqrt(aa * bb)) * across[2] / sqrt(length);
    }
    return fabs(sum) / (2.0 * PI);
}

static double below_a_ball(const double place[2])
{
    double squared = place[0] * place[0] + place[1] * place[1] + (double)(HEIGHT * HEIGHT);
    return (double)(HALF * HALF) / squared * (double)HEIGHT / sqrt(squared);
}

static void a_light_of(struct fixture *fixture, enum light_kind kind, float radiance)
{
    struct scene_light *light = fixture_light(fixture, kind, 0.0f, 0.0f, HEIGHT, radiance);
    light->size[0] = light->size[1] = kind == LIGHT_RECTANGLE ? 2.0f * HALF : HALF;
}

static void a_light(struct fixture *fixture, enum light_kind kind)
{
    a_light_of(fixture, kind, 1.0f);
}

/* The same rectangle as a surface; it looks down, and glows on both sides. A light that gives none keeps the
 * default sky away. */
static void a_glowing_square(struct fixture *fixture, bool sampled)
{
    const float above[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, HEIGHT};
    struct scene_material *glow = fixture_material(fixture);
    for (int c = 0; c < 3; c++) {
        glow->base_colour[c] = 0.0f;
        glow->emission[c] = 1.0f;
    }
    glow->alpha_mode = sampled ? ALPHA_OPAQUE : ALPHA_MASK;
    fixture_square(fixture, HALF, glow->base.id, above);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 3.0f, 0.0f);
}

static double (*closed_form)(const double place[2]);

/* Mean over the floor of what a pixel is above the closed form, relative. */
static double off_the_form(const struct frame_result *result)
{
    double sum = 0.0, expected = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        double place[2];
        place_of(i, place);
        sum += (double)fixture_pixel(result, i % EDGE, i / EDGE)[1];
        expected += closed_form(place);
    }
    return sum / expected - 1.0;
}

/* A box filter's mean over a pixel of 1/8 m is not the value at its middle: a sixth of a quarter of the curvature,
 * of two dimensions; that of these forms is below 1 / HEIGHT^2 relative. */
#define PIXEL_CURVATURE (2.0 / 24.0 * (1.0 / 8.0) * (1.0 / 8.0) / (double)(HEIGHT * HEIGHT))

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(lights_illuminate_a_floor_as_their_closed_forms_say)
{
    struct fixture *fixture = *state;
    static const unsigned tracers[] = {TRACER_REFERENCE, TRACER_BVH};
    static const struct {
        const char *name;
        enum light_kind kind;
        double (*form)(const double place[2]);
    } lights[] = {{"rectangle", LIGHT_RECTANGLE, below_a_rectangle}, {"sphere", LIGHT_SPHERE, below_a_ball}};
    for (size_t l = 0; l < COUNT(lights); l++)
        for (size_t t = 0; t < COUNT(tracers); t++)
            for (uint32_t depth = 0; depth < 2; depth++) {
                path_begin(fixture, tracers[t], depth);
                a_floor(fixture, 1.0f);
                a_light(fixture, lights[l].kind);
                fixture->request.samples = 16;
                closed_form = lights[l].form;
                struct mean mean = mean_of_seeds(fixture, off_the_form);
                print_message("%s, tracer %u, %s: off by %+.1e, standard error %.1e\n", lights[l].name, tracers[t],
                              depth ? "both ways" : "shadow rays", mean.value, mean.error);
                assert_mean(mean, 0.0, PIXEL_CURVATURE);
                assert_true(mean.error < 2e-3);
            }
    struct mean means[2];
    for (int sampled = 0; sampled < 2; sampled++) {
        path_begin(fixture, TRACER_REFERENCE, 1);
        a_floor(fixture, 1.0f);
        a_glowing_square(fixture, sampled);
        fixture->request.samples = 16;
        closed_form = below_a_rectangle;
        means[sampled] = mean_of_seeds(fixture, off_the_form);
        print_message("rectangle that glows, %s: off by %+.1e, standard error %.1e\n",
                      sampled ? "both ways" : "met alone", means[sampled].value, means[sampled].error);
        assert_mean(means[sampled], 0.0, PIXEL_CURVATURE);
    }
    assert_true(means[1].error < 0.05 * means[0].error); /* measured: 0.012 */
}

/* ---- glossy floors ---- */

static double whole(const struct frame_result *result)
{
    return mean_of_picture(result).value;
}

/* What a floor that mirrors roughly shows of a rectangle, found in four ways. */
TEST(shadow_rays_and_rays_that_go_on_find_the_same_light)
{
    struct fixture *fixture = *state;
    static const struct {
        float roughness, metallic, anisotropy;
    } floors[] = {{0.25f, 1.0f, 0.0f}, {0.5f, 1.0f, 0.7f}, {0.3f, 0.0f, 0.0f}, {0.8f, 0.5f, 0.3f}};
    for (int ward = 0; ward < 2; ward++)
        for (size_t f = 0; f < COUNT(floors); f++) {
            struct mean ways[4];
            /* Each floor by one of the two: accuracy/bsdf has each along a grain and without one. */
            if (f % 2 != (size_t)ward && !getenv("FARLIGHT_TEST_LONG"))
                continue;
            for (int way = 0; way < 4; way++) {
                path_begin(fixture, TRACER_REFERENCE, way == 0 ? 0 : 1);
                struct scene_material *material = a_floor(fixture, 1.0f);
                material->roughness = floors[f].roughness;
                material->metallic = floors[f].metallic;
                material->anisotropy = floors[f].anisotropy;
                material->anisotropy_rotation = 0.5f;
                material->ior = 1.5f;
                fixture_look(fixture, 1.5f, -1.5f, 1.2f, 0.8f); /* the light's image, and the floor beside it */
                if (way < 2)
                    a_light(fixture, LIGHT_RECTANGLE);
                else
                    a_glowing_square(fixture, way == 3);
                fixture->request.brdf = ward ? BRDF_WARD : BRDF_GGX;
                fixture->request.samples = way == 2 ? 32 : 8; /* what is met alone is noisier */
                ways[way] = mean_of_seeds(fixture, whole);
            }
            print_message(
                "%s, roughness %g, metallic %g, anisotropy %g: shadow rays %.5f (%.0e), both %.5f (%.0e), "
                "met alone %.5f (%.0e), as emitter %.5f (%.0e)\n",
                ward ? "ward" : "ggx", (double)floors[f].roughness, (double)floors[f].metallic,
                (double)floors[f].anisotropy, ways[0].value, ways[0].error, ways[1].value, ways[1].error,
                ways[2].value, ways[2].error, ways[3].value, ways[3].error);
            for (int way = 0; way < 4; way++) {
                const struct mean *other = &ways[(way + 1) % 4];
                assert_mean(ways[way], other->value, 5.0 * other->error);
                assert_true(ways[way].error < 0.01 * ways[way].value);
            }
        }
}

/* ---- kinds of lights ---- */

/* Where lights have no size and the floor is diffuse, a path without bounces is what whitted shows. */
TEST(point_lights_contribute_as_in_whitted)
{
    struct fixture *fixture = *state;
    for (int which = 0; which < 4; which++) { /* each alone, then all */
        struct mean means[2];
        for (int path = 0; path < 2; path++) {
            path_begin(fixture, TRACER_REFERENCE, 0);
            a_floor(fixture, 5.0f);
            if (which == 0 || which == 3)
                fixture_light(fixture, LIGHT_POINT, 0.5f, 0.3f, HEIGHT, 2.0f);
            if (which == 1 || which == 3)
                fixture_light(fixture, LIGHT_SPOT, -0.5f, 0.3f, HEIGHT, 5.0f);
            if (which == 2 || which == 3)
                fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, 0.3f);
            fixture_sphere(fixture, 0.3f, -0.4f, 0.4f, 0.3f, 0);
            if (!path)
                fixture->request.integrator = INTEGRATOR_WHITTED;
            fixture->request.samples = 16;
            means[path] = mean_of_seeds(fixture, whole);
        }
        print_message("lights %d: %.5f, whitted's %.5f (%.0e)\n", which, means[1].value, means[0].value,
                      means[1].error);
        /* The default material's ball mirrors a little in both; whitted's direct light is the same model. Both
         * have their samples in the same places. */
        assert_near(means[1].value, means[0].value, which < 3 ? 1e-5 : 5.0 * (means[1].error + means[0].error));
    }
}

TEST(lights_are_visible_in_mirrors_and_not_directly)
{
    struct fixture *fixture = *state;
    static const enum light_kind kinds[] = {LIGHT_RECTANGLE, LIGHT_SPHERE};
    for (size_t k = 0; k < COUNT(kinds); k++) {
        path_begin(fixture, TRACER_REFERENCE, 1);
        struct scene_material *mirror = a_floor(fixture, 5.0f); /* the light is between */
        mirror->metallic = 1.0f;
        mirror->roughness = 0.0f;
        a_light_of(fixture, kinds[k], 0.0f); /* one that is switched off is no obstacle */
        a_light(fixture, kinds[k]);
        struct frame_result result = fixture_render(fixture);
        for (uint32_t i = 0; i < PIXELS; i++) {
            double place[2];
            place_of(i, place);
            bool under = k == 0 ? fmax(fabs(place[0]), fabs(place[1])) < (double)HALF
                                : hypot(place[0], place[1]) < (double)HALF;
            assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[1], under ? 1.0 : 0.0, 1e-5);
        }
        frame_result_finish(&result);
    }
}

/* ---- glass ---- */

/* A roof of glass that neither bends nor mirrors takes a fifth of each colour, once, from what comes through it.
 * Light that was asked for came through it already; the rays that go on must not bring it again. */
TEST(light_through_glass_is_not_counted_twice)
{
    struct fixture *fixture = *state;
    enum { ENVIRONMENT_LIGHTS = 2 };
    for (int which = 0; which < 3; which++)
        for (int side = 0; side < 2; side++) {
            const float z = side ? 1.0f : -1.0f, roof[12] = {1, 0, 0, 0, 0, z, 0, 0, 0, 0, z, 1.5f};
            path_begin(fixture, TRACER_REFERENCE, 4);
            a_floor(fixture, 1.0f);
            struct scene_material *glass = fixture_material(fixture);
            glass->transmission = 1.0f;
            glass->roughness = 0.0f;
            for (int c = 0; c < 3; c++)
                glass->base_colour[c] = 0.8f;
            fixture_square(fixture, 2000.0f, glass->base.id, roof);
            if (which == ENVIRONMENT_LIGHTS)
                fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
            else
                a_light(fixture, which == 0 ? LIGHT_RECTANGLE : LIGHT_SPHERE);
            fixture->request.samples = 16;
            closed_form = which == 0 ? below_a_rectangle : below_a_ball;
            struct mean mean = mean_of_seeds(fixture, which == ENVIRONMENT_LIGHTS ? whole : off_the_form);
            print_message("through glass, light %d, side %d: %.5f (%.0e)\n", which, side, mean.value, mean.error);
            /* The cube root of what a shadow ray lets through is in 1023 steps: half of one is off by this. */
            const double half_step = 1.5 / 1023 * pow(0.8, 2.0 / 3);
            assert_mean(mean, which == ENVIRONMENT_LIGHTS ? 0.8 : -0.2, PIXEL_CURVATURE + 1e-4 + half_step);
            assert_true(mean.error < 5e-3);
        }
}

/* ---- environments ---- */

enum { ROWS = 32, COLUMNS = 64 };

static uint16_t half_from(float value) /* of a normal number that a half holds exactly */
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof(bits));
    return (uint16_t)(((bits >> 23) - 112u) << 10 | (bits >> 13 & 0x3ffu));
}

/* All of one grey, but for one texel. The floor's normal, +z, is the middle of the edges of the image's columns.
 */
static void an_image(struct fixture *fixture, float grey, uint32_t u, uint32_t v, float sun)
{
    static uint16_t texels[ROWS][COLUMNS][4];
    for (uint32_t y = 0; y < ROWS; y++)
        for (uint32_t x = 0; x < COLUMNS; x++)
            for (int c = 0; c < 4; c++)
                texels[y][x][c] = half_from(y == v && x == u ? sun : grey);
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    struct scene_environment *environment = &fixture->edits[fixture->edit_count - 1].set.environment;
    environment->width = COLUMNS;
    environment->height = ROWS;
    environment->texels = fixture_blob(texels, sizeof(texels));
}

/* Irradiance by pi on a surface that looks along +z, of the image blended between its texels. */
static double under_the_image(double grey, uint32_t u, uint32_t v, double sun)
{
    enum { FINE = 16 };
    double sum = 0.0;
    for (int y = 0; y < ROWS * FINE; y++)
        for (int x = 0; x < COLUMNS * FINE; x++) {
            double theta = (y + 0.5) * PI / (ROWS * FINE), phi = ((x + 0.5) / (COLUMNS * FINE) - 0.5) * 2.0 * PI;
            double cosine = -sin(theta) * cos(phi); /* the image's middle is -z */
            double du = fabs((x + 0.5) / FINE - 0.5 - u), dv = fabs((y + 0.5) / FINE - 0.5 - v);
            double share = fmax(1.0 - fmin(du, COLUMNS - du), 0.0) * fmax(1.0 - dv, 0.0);
            if (cosine > 0.0)
                sum += (grey + (sun - grey) * share) * cosine * sin(theta) * PI / (ROWS * FINE) * 2.0 * PI /
                       (COLUMNS * FINE);
        }
    return sum / PI;
}

static double relative_deviation; /* of a picture's pixels, from the value that all should have */
static double expected_value;
static double deviation_and_mean(const struct frame_result *result)
{
    double squares = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        double off = (double)fixture_pixel(result, i % EDGE, i / EDGE)[1] / expected_value - 1.0;
        squares += off * off / PIXELS;
    }
    relative_deviation = fmax(relative_deviation, sqrt(squares));
    return mean_of_picture(result).value / expected_value - 1.0;
}

TEST(a_small_bright_sun_converges)
{
    struct fixture *fixture = *state;
    const uint32_t u = 4, v = 12;
    /* By a texel of 4096 among 0.125 the sun brings nearly all of the light, from a thousandth of the directions.
     */
    expected_value = under_the_image(0.125, u, v, 4096.0);
    for (uint32_t depth = 0; depth < 2; depth++)
        for (uint32_t samples = 2; samples <= 128; samples *= 8) {
            path_begin(fixture, TRACER_REFERENCE, depth);
            a_floor(fixture, 1.0f);
            an_image(fixture, 0.125f, u, v, 4096.0f);
            fixture->request.samples = samples;
            relative_deviation = 0.0;
            struct mean mean = mean_of_seeds(fixture, deviation_and_mean);
            print_message("sun, %s, %3u samples: off by %+.1e (standard error %.0e), pixels by %.3f\n",
                          depth ? "both ways" : "shadow rays", samples, mean.value, mean.error,
                          relative_deviation);
            assert_mean(mean, 0.0, 1e-3); /* the sum's own steps */
            /* Between texels radiance goes as a ramp, from all over half a cell to a half at its edge, and on to
             * nothing in the middle of the next, while a cell has one probability: three quarters of the samples
             * have a mean square of 28/27 and a quarter 8/3, of both ramps (13/9)^2. So one deviates by 1.04; the
             * rest of the image and the scatter of this measure, over 1024 pixels and 16 pictures, stay below a
             * fifth. */
            assert_true(relative_deviation < 1.25 / sqrt(samples));
        }
}

TEST(an_image_of_one_colour_is_that_colour)
{
    struct fixture *fixture = *state;
    for (uint32_t depth = 0; depth < 2; depth++) {
        path_begin(fixture, TRACER_REFERENCE, depth);
        a_floor(fixture, 1.0f);
        an_image(fixture, 0.5f, 0, 0, 0.5f);
        fixture->request.samples = 16;
        expected_value = 0.5;
        struct mean mean = mean_of_seeds(fixture, deviation_and_mean);
        assert_mean(mean, 0.0, 1e-5);
        assert_true(mean.error < 5e-3);
    }
}

/* The sky of a scene without lights, without its sun: a floor that looks up sees its zenith's half. */
TEST(the_default_sky_brings_what_its_harmonics_say)
{
    struct fixture *fixture = *state;
    struct mean means[2];
    for (int path = 0; path < 2; path++) {
        const float level[12] = {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0}; /* looks along +y */
        path_begin(fixture, TRACER_REFERENCE, 1);
        struct scene_material *floor = fixture_material(fixture);
        fixture_square(fixture, 50.0f, floor->base.id, level);
        fixture_look(fixture, 0.0f, 5.0f, 0.0f, 0.0f);
        fixture->request.camera.ortho_height = VIEW;
        if (!path) /* its ambient term is the irradiance of the sky; the default light is in both */
            fixture->request.integrator = INTEGRATOR_WHITTED;
        fixture->request.samples = 16;
        means[path] = mean_of_seeds(fixture, whole);
    }
    print_message("default sky: %.5f (%.0e), whitted's %.5f\n", means[1].value, means[1].error, means[0].value);
    /* Harmonics of order 2 leave out up to 1 % of an irradiance (Ramamoorthi and Hanrahan 2001). */
    assert_mean(means[1], means[0].value, 0.01 * means[0].value);
}
