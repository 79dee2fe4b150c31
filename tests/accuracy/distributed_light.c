/* SPDX-License-Identifier: MIT */
/* What rough surfaces mirror of lamps and of the bright parts of an image about the scene, by the integrator
 * `distributed`: as much as `path` finds, and as what rays that hit them find alone, with less noise. */
#include "tests/accuracy/path_fixture.h"
#include "tests/harness/test.h"

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

static double whole(const struct frame_result *result)
{
    return mean_of_picture(result).value;
}

static void begin(struct fixture *fixture, enum integrator_kind integrator, uint32_t samples)
{
    path_begin(fixture, TRACER_REFERENCE, 1);
    fixture->request.integrator = integrator;
    fixture->request.samples = samples;
}

/* Seen at a slant, so that the image of what is above it is in the picture. */
static struct scene_material *a_floor(struct fixture *fixture, float roughness, float metallic)
{
    struct scene_material *floor = fixture_material(fixture);
    floor->roughness = roughness;
    floor->metallic = metallic;
    floor->ior = 1.5f;
    fixture_square(fixture, 50.0f, floor->base.id, NULL);
    fixture_look(fixture, 1.5f, -1.5f, 1.2f, 0.8f);
    return floor;
}

/* A lamp of two triangles; with a mask, that cuts nothing out, no shadow ray asks for it. A light that gives none
 * keeps the default sky away. */
static void a_lamp(struct fixture *fixture, float half, float radiance, bool sampled)
{
    const float above[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 2.0f};
    struct scene_material *glow = fixture_material(fixture);
    for (int c = 0; c < 3; c++) {
        glow->base_colour[c] = 0.0f;
        glow->emission[c] = radiance;
    }
    glow->alpha_mode = sampled ? ALPHA_OPAQUE : ALPHA_MASK;
    fixture_square(fixture, half, glow->base.id, above);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 3.0f, 0.0f);
}

/* A pane between floor and lamp: of glass that does not bend light, or a blended one. */
static void a_pane(struct fixture *fixture, bool glass)
{
    const float below_lamp[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1.5f};
    struct scene_material *pane = fixture_material(fixture);
    pane->roughness = 0.0f;
    pane->base_colour[1] = 0.8f;
    pane->transmission = glass ? 1.0f : 0.0f;
    pane->alpha_mode = glass ? ALPHA_OPAQUE : ALPHA_BLEND;
    pane->base_colour[3] = 0.4f;
    fixture_square(fixture, 5.0f, pane->base.id, below_lamp);
}

static struct mean metal_with_a_lamp(struct fixture *fixture, float roughness, bool sampled, uint32_t samples)
{
    begin(fixture, INTEGRATOR_DISTRIBUTED, samples);
    a_floor(fixture, roughness, 1.0f);
    a_lamp(fixture, 0.25f, 10.0f, sampled);
    return mean_of_seeds(fixture, whole);
}

TEST(rough_metal_mirrors_a_lamp_as_its_rays_alone_find_it)
{
    struct fixture *fixture = *state;
    static const float roughnesses[] = {0.15f, 0.3f, 0.6f, 1.0f};
    for (size_t i = 0; i < COUNT(roughnesses); i += getenv("FARLIGHT_TEST_LONG") ? 1 : 3) { /* or the ends */
        const struct mean met = metal_with_a_lamp(fixture, roughnesses[i], false, 64),
                          both = metal_with_a_lamp(fixture, roughnesses[i], true, 16);
        print_message("roughness %g: met alone %.5f (%.0e), both ways %.5f (%.0e) of a quarter of the samples\n",
                      (double)roughnesses[i], met.value, met.error, both.value, both.error);
        assert_mean(both, met.value, 5.0 * met.error);
        assert_true(met.error < 0.02 * met.value && both.error < 2.0 * met.error);
    }
}

static void what_path_finds(struct fixture *fixture, const char *name, void (*add)(struct fixture *fixture),
                            float roughness, float metallic)
{
    struct mean means[2];
    for (int path = 0; path < 2; path++) {
        begin(fixture, path ? INTEGRATOR_PATH : INTEGRATOR_DISTRIBUTED, 16);
        a_floor(fixture, roughness, metallic);
        add(fixture);
        means[path] = mean_of_seeds(fixture, whole);
    }
    print_message("%s, roughness %g, metallic %g: distributed %.5f (%.0e), path %.5f (%.0e)\n", name,
                  (double)roughness, (double)metallic, means[0].value, means[0].error, means[1].value,
                  means[1].error);
    /* Both have the same polynomials of what facets mirror more than once, and choose it differently. */
    assert_mean(means[0], means[1].value, 5.0 * means[1].error + 2e-3 * means[1].value);
    assert_true(means[0].error < 0.04 * means[0].value);
}

static void lamp(struct fixture *fixture)
{
    a_lamp(fixture, 0.25f, 10.0f, true);
}

static void lamp_behind_glass(struct fixture *fixture)
{
    fixture->request.depth = 2;
    a_lamp(fixture, 0.25f, 10.0f, true);
    a_pane(fixture, true);
}

static void lamp_behind_a_veil(struct fixture *fixture)
{
    a_lamp(fixture, 0.25f, 10.0f, true);
    a_pane(fixture, false);
}

static void lamp_beside_lights(struct fixture *fixture)
{
    a_lamp(fixture, 0.25f, 10.0f, true);
    fixture_light(fixture, LIGHT_POINT, -0.5f, 0.3f, 1.5f, 0.3f);
}

enum { ROWS = 32, COLUMNS = 64 };

/* Of one grey, but for a sun of one texel, some 0.01 steradians. The floor's normal, +z, is the middle of the
 * edges of the image's columns. */
static void a_sun(struct fixture *fixture)
{
    enum { GREY = 0x2c00, SUN = 0x6400 }; /* halves: 1/16 and 1024 */
    static uint16_t texels[ROWS][COLUMNS][4];
    for (uint32_t y = 0; y < ROWS; y++)
        for (uint32_t x = 0; x < COLUMNS; x++)
            for (int c = 0; c < 4; c++)
                texels[y][x][c] = y == 13 && x == 3 ? SUN : GREY;
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    struct scene_environment *environment = &fixture->edits[fixture->edit_count - 1].set.environment;
    environment->width = COLUMNS;
    environment->height = ROWS;
    environment->texels = fixture_blob(texels, sizeof(texels));
}

static void a_sun_beside_lights(struct fixture *fixture)
{
    a_sun(fixture);
    fixture_light(fixture, LIGHT_POINT, -0.5f, 0.3f, 1.5f, 3.0f);
    a_lamp(fixture, 0.25f, 10.0f, true);
}

TEST(rough_surfaces_mirror_what_path_finds)
{
    struct fixture *fixture = *state;
    what_path_finds(fixture, "lamp", lamp, 0.3f, 1.0f);
    what_path_finds(fixture, "lamp", lamp, 0.3f, 0.0f);
    what_path_finds(fixture, "lamp behind a veil", lamp_behind_a_veil, 0.3f, 1.0f);
    what_path_finds(fixture, "lamp behind glass", lamp_behind_glass, 0.3f, 1.0f);
    what_path_finds(fixture, "lamp beside lights", lamp_beside_lights, 0.3f, 0.5f);
    what_path_finds(fixture, "sun", a_sun, 0.3f, 1.0f);
    what_path_finds(fixture, "sun beside lights", a_sun_beside_lights, 0.4f, 1.0f);
    if (getenv("FARLIGHT_TEST_LONG")) { /* other roughnesses of the same */
        what_path_finds(fixture, "lamp", lamp, 1.0f, 1.0f);
        what_path_finds(fixture, "sun", a_sun, 0.7f, 1.0f);
    }
}

/* ---- noise ---- */

/* The root of the mean squared error by the mean. */
static double error_of(const float *pixels, const float *truth)
{
    double squares = 0.0, sum = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        const double error = (double)pixels[i] - (double)truth[i];
        squares += error * error;
        sum += (double)truth[i];
    }
    return sqrt(squares / PIXELS) / (sum / PIXELS);
}

static double noise_of_a_lamp(struct fixture *fixture, float half, bool sampled, const float *truth)
{
    begin(fixture, INTEGRATOR_DISTRIBUTED, 16);
    a_floor(fixture, 0.3f, 1.0f);
    a_lamp(fixture, half, 1.0f, sampled);
    float *noisy = path_render_pixels(fixture, 16, 1);
    const double error = error_of(noisy, truth);
    free(noisy);
    return error;
}

TEST(rough_metal_shows_no_specks_of_lamps)
{
    struct fixture *fixture = *state;
    begin(fixture, INTEGRATOR_PATH, 1);
    a_floor(fixture, 0.3f, 1.0f);
    a_lamp(fixture, 0.05f, 1.0f, true);
    float *truth = path_render_pixels(fixture, 1024, 9);
    const double met = noise_of_a_lamp(fixture, 0.05f, false, truth),
                 both = noise_of_a_lamp(fixture, 0.05f, true, truth);
    free(truth);
    print_message("error of 16 samples, by the mean: met alone %.3f, both ways %.4f\n", met, both);
    assert_true(both < met / 20.0); /* a third of what was measured */
}

TEST(rough_metal_shows_no_specks_of_the_sun)
{
    struct fixture *fixture = *state;
    float *pictures[2];
    for (int truth = 0; truth < 2; truth++) {
        begin(fixture, truth ? INTEGRATOR_PATH : INTEGRATOR_DISTRIBUTED, 1);
        a_floor(fixture, 0.3f, 1.0f);
        a_sun(fixture);
        pictures[truth] = path_render_pixels(fixture, truth ? 1024 : 16, truth ? 9 : 1);
    }
    const double error = error_of(pictures[0], pictures[1]);
    print_message("error of 16 samples, by the mean: %.3f\n", error);
    /* By its table 16 samples of a sun's texel, blended with its neighbours', have an error of 1.04 / sqrt(16)
     * (path_light.c): by the picture's mean twice that, as it is mirrored in a quarter of it. Rays that find it
     * alone had 2.6. */
    assert_true(error < 0.8);
    free(pictures[0]);
    free(pictures[1]);
}
