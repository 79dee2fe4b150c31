/* SPDX-License-Identifier: MIT */
/* Denoised pictures: nearer to the truth than noisy ones, the same where there is no noise, and as samples are
 * added the same in the end. That no scene is worse for it: tests/integration/test_pictures.py. */
#include "tests/accuracy/path_fixture.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/harness/test.h"

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

enum { TEXELS = EDGE };

/* The wall in front of the eye, and behind it, turned round. */
static const float FRONT[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                   BACK[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 9};

/* A wall that fills the picture, with a checker of a texel a pixel, 1 and 1/4; under a sky, next to a ball that
 * hides some of that. Scattered light is noise. Returns what the wall is made of. */
static struct scene_material *a_checker(struct fixture *fixture, const float place[12])
{
    static uint8_t texels[TEXELS * TEXELS * 4];
    for (uint32_t i = 0; i < TEXELS * TEXELS; i++)
        memset(texels + 4 * i, (i % TEXELS + i / TEXELS) % 2 ? 255 : 64, 4);
    path_begin(fixture, TRACER_BVH, 2);
    struct scene_texture *texture = &fixture_edit(fixture, OBJECT_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->value.width = texture->value.height = TEXELS;
    texture->value.format = TEXTURE_RGBA8_LINEAR;
    texture->value.nearest = true;
    texture->texels = fixture_blob(texels, sizeof(texels));
    struct scene_material *material = fixture_material(fixture), *dark = fixture_material(fixture);
    material->textures[MATERIAL_BASE_COLOUR] = (struct record_texture_use){
        .texture = texture->base.id, .uv_transform = {1, 0, 0, 0, 1, 0}, .strength = 1.0f};
    dark->value.base_colour[0] = dark->value.base_colour[1] = dark->value.base_colour[2] = 0.0f;
    fixture_square(fixture, 1.0f, material->base.id, place);
    fixture_sphere(fixture, 1.5f, 0.0f, 0.5f * place[10] + place[11], 0.5f, dark->base.id);
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    fixture->request.camera.fov_y = 0.0f;
    fixture->request.camera.ortho_height = 2.0f;
    return material;
}

static struct frame_result rendered(struct fixture *fixture, enum denoise denoise, uint32_t samples, uint64_t seed)
{
    fixture->request.picture.denoise = denoise;
    fixture->request.sampling.samples = samples;
    fixture->request.sampling.seed = seed;
    return fixture_render(fixture);
}

/* Root of the mean square difference, of green. */
static double distance(const struct frame_result *a, const struct frame_result *b)
{
    const size_t count = (size_t)a->width * a->height;
    double sum = 0.0;
    for (uint32_t i = 0; i < count; i++) {
        const double difference = (double)fixture_pixel(a, i % a->width, i / a->width)[1] -
                                  (double)fixture_pixel(b, i % a->width, i / a->width)[1];
        sum += difference * difference;
    }
    return sqrt(sum / (double)count);
}

/* How much of the truth's difference between neighbours a picture has, by least squares. */
static double contrast(const struct frame_result *picture, const struct frame_result *truth)
{
    double product = 0.0, square = 0.0;
    for (uint32_t i = 0; i < EDGE * (EDGE - 1); i++) {
        const uint32_t x = i % (EDGE - 1), y = i / (EDGE - 1);
        const double there = (double)(fixture_pixel(truth, x, y)[1] - fixture_pixel(truth, x + 1, y)[1]);
        product += there * (double)(fixture_pixel(picture, x, y)[1] - fixture_pixel(picture, x + 1, y)[1]);
        square += there * there;
    }
    return product / square;
}

/* The contrast of denoised pictures is off by the noise that is left, 5 % of the light at most, over the root of
 * the number of pixels, which is 32: 3 % are many times that. A filter of three pixels that did not divide by the
 * albedo would take nearly all contrast of a checker. Light is smooth here, so most of the noise can go, and half
 * must. */
static void expect_detail_without_noise(struct fixture *fixture)
{
    struct frame_result truth = rendered(fixture, DENOISE_OFF, 256, 7);
    for (uint32_t samples = 1; samples <= 16; samples *= 4) {
        struct frame_result noisy = rendered(fixture, DENOISE_OFF, samples, 1);
        struct frame_result denoised = rendered(fixture, DENOISE_ON, samples, 1);
        assert_true(distance(&denoised, &truth) < 0.5 * distance(&noisy, &truth));
        assert_near(contrast(&denoised, &truth), 1.0, 0.03);
        frame_result_finish(&noisy);
        frame_result_finish(&denoised);
    }
    frame_result_finish(&truth);
}

TEST(a_texture_keeps_its_detail_while_its_noise_goes)
{
    a_checker(*state, FRONT);
    expect_detail_without_noise(*state);
}

/* A dark wall's light, which is divided by the albedo, is far above what five stops make white; what is shown is
 * not. */
TEST(an_exposure_for_what_is_dark_filters_no_less)
{
    struct fixture *fixture = *state;
    struct scene_material *wall = a_checker(fixture, FRONT);
    wall->value.base_colour[0] = wall->value.base_colour[1] = wall->value.base_colour[2] = 1.0f / 32.0f;
    struct frame_result noisy = rendered(fixture, DENOISE_OFF, 16, 1),
                        usual = rendered(fixture, DENOISE_ON, 16, 1);
    fixture->request.picture.exposure_stops = 5.0f;
    struct frame_result exposed = rendered(fixture, DENOISE_ON, 16, 1);
    assert_true(distance(&noisy, &usual) > 0.001);
    for (uint32_t i = 0; i < EDGE * EDGE; i++) /* halves hold a 2048th */
        assert_near(fixture_pixel(&exposed, i % EDGE, i / EDGE)[1],
                    32.0f * fixture_pixel(&usual, i % EDGE, i / EDGE)[1], 0.01);
    frame_result_finish(&noisy);
    frame_result_finish(&usual);
    frame_result_finish(&exposed);
}

/* The mirror takes the wall's normal and albedo: with its own, a single sample would be left unfiltered. */
TEST_LONG(so_it_does_in_a_mirror)
{
    struct fixture *fixture = *state;
    a_checker(fixture, BACK);
    struct scene_material *mirror = fixture_material(fixture);
    mirror->value.metallic = 1.0f;
    mirror->value.roughness = 0.0f;
    fixture_square(fixture, 1.0f, mirror->base.id, FRONT);
    expect_detail_without_noise(fixture);
}

TEST_LONG(pictures_without_noise_stay_as_they_are)
{
    struct fixture *fixture = *state;
    static const unsigned integrators[] = {INTEGRATOR_WHITTED, INTEGRATOR_RAYCAST};
    fixture_mixture(fixture);
    fixture->request.tracing.tracer = TRACER_BVH;
    for (size_t i = 0; i < COUNT(integrators); i++) {
        fixture->request.light.integrator = integrators[i];
        struct frame_result plain = rendered(fixture, DENOISE_OFF, 4, 0);
        struct frame_result denoised = rendered(fixture, DENOISE_ON, 4, 0);
        assert_same_picture(&plain, &denoised);
        frame_result_finish(&plain);
        frame_result_finish(&denoised);
    }
}

/* A lamp without extent, straight down: the edge of its shadow crosses the picture, and nothing is random but
 * where samples lie in their pixels. One sample lies in the middle. */
TEST(a_hard_shadow_stays_hard)
{
    struct fixture *fixture = *state;
    path_begin(fixture, TRACER_BVH, 0);
    const uint32_t white = fixture_material(fixture)->base.id;
    const float shade[12] = {1, 0, 0, 0.0f, 0, 1, 0, 7.3f, 0, 0, 1, 6.0f};
    fixture_square(fixture, 4.0f, white, NULL);
    fixture_square(fixture, 7.0f, white, shade); /* behind the eye */
    fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 9.0f, 1.0f);
    struct frame_result plain = rendered(fixture, DENOISE_OFF, 1, 0);
    struct frame_result denoised = rendered(fixture, DENOISE_ON, 1, 0);
    assert_true(fixture_pixel(&plain, 16, 0)[1] < 0.1f * fixture_pixel(&plain, 16, EDGE - 1)[1]);
    assert_true(distance(&plain, &denoised) < 1e-6);
    frame_result_finish(&plain);
    frame_result_finish(&denoised);
}

/* A filter that did not end would leave its blur: here it moves the picture by less than its noise is, and that
 * falls as samples are added. */
TEST_LONG(with_many_samples_the_denoised_picture_is_the_noisy_one)
{
    struct fixture *fixture = *state;
    a_checker(fixture, FRONT);
    double before = 1e9;
    for (uint32_t samples = 4; samples <= 1024; samples *= 16) {
        struct frame_result plain = rendered(fixture, DENOISE_OFF, samples, 0);
        struct frame_result denoised = rendered(fixture, DENOISE_ON, samples, 0);
        const double moved = distance(&plain, &denoised);
        assert_true(moved < 0.5 * before);
        before = moved;
        frame_result_finish(&plain);
        frame_result_finish(&denoised);
    }
    assert_true(before < 0.005);
}

TEST_LONG(a_denoised_picture_is_the_same_however_it_was_cut_queued_and_added_up)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.light.integrator = INTEGRATOR_DISTRIBUTED;
    struct frame_result whole = rendered(fixture, DENOISE_ON, 6, 3);
    frame_renderer_queue_ahead(fixture->renderer, true);
    struct frame_result queued = rendered(fixture, DENOISE_ON, 6, 3);
    assert_same_picture(&whole, &queued);
    frame_renderer_set_capacity(fixture->renderer, 777, 1000);
    struct frame_result cut = rendered(fixture, DENOISE_ON, 6, 3);
    assert_same_picture(&whole, &cut);
    frame_renderer_set_capacity(fixture->renderer, 0, 0);
    frame_result_finish(&whole);
    frame_result_finish(&queued);
    frame_result_finish(&cut);

    fixture->request.sampling.accumulate = true;
    struct frame_result added = {0};
    for (uint32_t samples = 1; samples <= 3; samples++) { /* 1 + 2 + 3 */
        frame_result_finish(&added);
        added = rendered(fixture, DENOISE_ON, samples, 4);
    }
    assert_int_equal(added.samples, 6);
    struct frame_result other = rendered(fixture, DENOISE_ON, 1, 5); /* so that the next begins anew */
    whole = rendered(fixture, DENOISE_ON, 6, 4);
    assert_same_picture(&whole, &added);
    frame_result_finish(&whole);
    frame_result_finish(&added);
    frame_result_finish(&other);
}

TEST(auto_denoises_few_samples_alone)
{
    struct fixture *fixture = *state;
    a_checker(fixture, FRONT);
    for (uint32_t samples = 64; samples <= 128; samples *= 2) {
        struct frame_result plain = rendered(fixture, DENOISE_OFF, samples, 1);
        struct frame_result always = rendered(fixture, DENOISE_ON, samples, 1);
        struct frame_result few = rendered(fixture, DENOISE_AUTO, samples, 1);
        assert_true(distance(&plain, &always) > 0.0);
        assert_same_picture(&few, samples < 128 ? &always : &plain);
        frame_result_finish(&plain);
        frame_result_finish(&always);
        frame_result_finish(&few);
    }
}
