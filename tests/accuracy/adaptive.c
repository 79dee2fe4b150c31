/* SPDX-License-Identifier: MIT */
/* Adaptive sampling: tiles stop when their error is below the limit, hold what a picture of so many samples holds,
 * and are as near to the truth as was asked for. */
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/harness/test.h"

enum { WIDTH = 64, HEIGHT = 32, ACROSS = WIDTH / 8, TILES = ACROSS * (HEIGHT / 8), SAMPLES_MAX = 1024 };
#define LIMIT 0.04f

/* On the left a plate that shines as it is coloured; on the right a wall in the soft shadow of a ball. */
static void half_noisy(struct fixture *fixture)
{
    struct scene_material *flat = fixture_material(fixture), *wall = fixture_material(fixture);
    flat->value.unlit = true;
    flat->value.base_colour[0] = 0.5f;
    const float before[12] = {1, 0, 0, -10, 0, 1, 0, 0, 0, 0, 1, 1.0f};
    fixture_square(fixture, 10.0f, flat->base.id, before);
    fixture_square(fixture, 10.0f, wall->base.id, NULL);
    fixture_sphere(fixture, 1.2f, 0.0f, 0.8f, 0.4f, wall->base.id);
    fixture_light(fixture, LIGHT_SPHERE, 1.5f, 0.5f, 3.0f, 60.0f);
    fixture->request.picture.width = WIDTH;
    fixture->request.picture.height = HEIGHT;
    fixture->request.camera.fov_y = 0.0f;
    fixture->request.camera.ortho_height = 2.4f;
    fixture->request.light.integrator = INTEGRATOR_DISTRIBUTED;
    fixture->request.light.depth = 0;
    fixture->request.sampling.noise = LIMIT;
    fixture->request.sampling.samples = SAMPLES_MAX;
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

static struct frame_result plain(struct fixture *fixture, uint32_t samples)
{
    const struct frame_request adaptive = fixture->request;
    fixture->request.sampling.noise = 0.0f;
    fixture->request.sampling.accumulate =
        true; /* whose textures and order of lights do not depend on the number either */
    fixture->request.sampling.samples = samples;
    fixture->request.sampling.seed++; /* not gone on from the last */
    struct frame_result other = fixture_render(fixture);
    frame_result_finish(&other);
    fixture->request.sampling.seed--;
    struct frame_result result = fixture_render(fixture);
    fixture->request = adaptive;
    return result;
}

static bool same_tile(const struct frame_result *a, const struct frame_result *b, uint32_t tile)
{
    for (uint32_t row = 0; row < 8; row++) {
        const uint32_t x = tile % ACROSS * 8, y = tile / ACROSS * 8 + row;
        if (memcmp(fixture_pixel(a, x, y), fixture_pixel(b, x, y), 8 * 4 * sizeof(float)) != 0)
            return false;
    }
    return true;
}

TEST_LONG(a_tile_stops_by_its_error_and_is_that_of_a_picture_of_so_many_samples)
{
    struct fixture *fixture = *state;
    static const uint32_t counts[] = {16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024};
    enum { COUNTS = sizeof(counts) / sizeof(counts[0]) };
    uint32_t stopped_at[TILES] = {0};
    uint64_t rays = 0;
    half_noisy(fixture);
    struct frame_result result = fixture_render(fixture);
    assert_true(result.samples > 32 && result.samples < SAMPLES_MAX);
    assert_true(result.noise > 0.0f && result.noise <= LIMIT);
    for (size_t k = 0; k < COUNTS && counts[k] <= result.samples; k++) {
        struct frame_result all = plain(fixture, counts[k]);
        for (uint32_t tile = 0; tile < TILES; tile++)
            if (!stopped_at[tile] && same_tile(&result, &all, tile)) {
                stopped_at[tile] = counts[k];
                rays += counts[k] * 64;
            }
        frame_result_finish(&all);
    }
    bool reached = false;
    for (uint32_t tile = 0; tile < TILES; tile++) {
        if (!stopped_at[tile])
            fail_msg("tile %u is like no picture's", tile);
        /* Beside the last column of the plate the filter reaches over its edge. */
        if (tile % ACROSS < ACROSS / 2 - 1)
            assert_int_equal(stopped_at[tile], 16);
        reached |= stopped_at[tile] == result.samples;
    }
    assert_true(reached);
    assert_int_equal(result.primary_rays, rays);
    print_message("%u samples at most, %.1f in the mean\n", result.samples, (double)rays / (WIDTH * HEIGHT));
    assert_true(rays < (uint64_t)result.samples * WIDTH * HEIGHT / 2); /* half of it is flat */
    frame_result_finish(&result);
}

/* The error of a tile by the definition in server/render/picture/noise.h. */
static double error_of_tile(const struct frame_result *result, const struct frame_result *truth, uint32_t tile)
{
    double squares = 0.0, light = 0.0;
    for (uint32_t i = 0; i < 64; i++) {
        const uint32_t x = tile % ACROSS * 8 + i % 8, y = tile / ACROSS * 8 + i / 8;
        for (int c = 0; c < 3; c++) {
            const double off = (double)fixture_pixel(result, x, y)[c] - (double)fixture_pixel(truth, x, y)[c];
            squares += off * off / 192.0;
            light += (double)fixture_pixel(truth, x, y)[c] / 192.0;
        }
    }
    return sqrt(squares) / (light + 0.03);
}

TEST_LONG(the_error_against_the_converged_picture_is_below_the_limit)
{
    struct fixture *fixture = *state;
    half_noisy(fixture);
    struct frame_result truth = plain(fixture, 1024);
    for (int i = 0; i < 2; i++) {
        fixture->request.sampling.noise = i ? LIMIT / 2 : LIMIT;
        struct frame_result result = fixture_render(fixture);
        double worst = 0.0, squares = 0.0;
        for (uint32_t tile = 0; tile < TILES; tile++) {
            const double error = error_of_tile(&result, &truth, tile);
            worst = fmax(worst, error);
            squares += error * error / TILES;
        }
        const double limit = (double)fixture->request.sampling.noise;
        print_message("limit %.3f: %u samples at most, off by %.4f, the worst tile by %.4f\n", limit,
                      result.samples, sqrt(squares), worst);
        /* A tile's estimate is from 64 pixels, and known to 1 / sqrt(128) = 9 % where they are alike: of 32 tiles
         * the worst is three of those off. Where only a few pixels are noisy it is known less well: twice that. */
        assert_true(worst <= limit * 1.5);
        assert_true(sqrt(squares) <= limit);
        frame_result_finish(&result);
    }
    frame_result_finish(&truth);
}

/* Over all tiles, the root of the mean square. */
static double error_of_picture(const struct frame_result *result, const struct frame_result *truth)
{
    double squares = 0.0;
    for (uint32_t tile = 0; tile < TILES; tile++)
        squares += pow(error_of_tile(result, truth, tile), 2.0) / TILES;
    return sqrt(squares);
}

/* Sampling stops by the noise of the unfiltered picture, so both pictures have the same samples; those of a
 * tile that has stopped are few. Light is stratified, so the gain is small: a fifth with 16 samples
 * everywhere, a fiftieth with 32. */
TEST_LONG(a_picture_that_stops_by_its_noise_is_nearer_to_the_truth_denoised)
{
    struct fixture *fixture = *state;
    half_noisy(fixture);
    struct frame_result truth = plain(fixture, 1024);
    struct frame_result noisy = fixture_render(fixture);
    fixture->request.picture.denoise = DENOISE_ON;
    struct frame_result denoised = fixture_render(fixture);
    assert_int_equal(noisy.primary_rays, denoised.primary_rays);
    assert_near(noisy.noise, denoised.noise, 0.0);
    const double with = error_of_picture(&denoised, &truth), without = error_of_picture(&noisy, &truth);
    print_message("off by %.4f, denoised by %.4f\n", without, with);
    assert_true(with < without);
    frame_renderer_set_capacity(fixture->renderer, 777, 1000);
    struct frame_result cut = fixture_render(fixture);
    assert_memory_equal(denoised.pixels, cut.pixels, denoised.size_bytes);
    frame_renderer_set_capacity(fixture->renderer, 0, 0);
    frame_result_finish(&truth);
    frame_result_finish(&noisy);
    frame_result_finish(&denoised);
    frame_result_finish(&cut);
}

TEST_LONG(a_picture_stops_alike_however_it_is_cut)
{
    struct fixture *fixture = *state;
    half_noisy(fixture);
    fixture->request.sampling.samples = 64;
    for (int traced = 0; traced < 2; traced++) {
        fixture->request.tracing.primary = traced ? PRIMARY_TRACE : PRIMARY_RASTER;
        frame_renderer_set_capacity(fixture->renderer, 0, 0);
        struct frame_result whole = fixture_render(fixture);
        frame_renderer_set_capacity(fixture->renderer, 1000, 1000);
        struct frame_result cut = fixture_render(fixture);
        assert_memory_equal(whole.pixels, cut.pixels, whole.size_bytes);
        assert_int_equal(whole.primary_rays, cut.primary_rays);
        frame_renderer_set_capacity(fixture->renderer, 0, 0);
        frame_renderer_queue_ahead(fixture->renderer, true);
        struct frame_result queued = fixture_render(fixture);
        assert_memory_equal(whole.pixels, queued.pixels, whole.size_bytes);
        frame_result_finish(&queued);
        frame_renderer_queue_ahead(fixture->renderer, false);
        fixture->request.sampling.accumulate = true;
        fixture->request.samples_max = 64;
        for (uint32_t held = 0; held < 64;) {
            fixture->request.sampling.samples = held < 20 ? 5 : 22;
            struct frame_result part = fixture_render(fixture);
            held = part.samples;
            if (held == 64)
                assert_memory_equal(whole.pixels, part.pixels, whole.size_bytes);
            frame_result_finish(&part);
        }
        fixture->request.sampling.accumulate = false;
        fixture->request.sampling.samples = 64;
        frame_result_finish(&whole);
        frame_result_finish(&cut);
    }
}

TEST(a_picture_without_noise_has_the_fewest_samples_and_is_handed_out_again)
{
    struct fixture *fixture = *state;
    struct scene_material *flat = fixture_material(fixture);
    flat->value.unlit = true;
    fixture_square(fixture, 10.0f, flat->base.id, NULL);
    fixture->request.camera.fov_y = 0.0f;
    fixture->request.camera.ortho_height = 1.0f;
    fixture->request.picture.width = 24;
    fixture->request.picture.height = 20; /* tiles reach beyond it */
    fixture->request.sampling.noise = LIMIT;
    fixture->request.sampling.samples = SAMPLES_MAX;
    fixture->request.sampling.accumulate = true;
    for (int again = 0; again < 2; again++) {
        struct frame_result result = fixture_render(fixture);
        assert_int_equal(result.samples, 16);
        assert_int_equal(result.primary_rays, again ? 0 : 16 * 24 * 20);
        assert_near(result.noise, 0.0, 0.0);
        assert_near(fixture_pixel(&result, 23, 19)[0], 1.0, 1e-6);
        frame_result_finish(&result);
    }
}

static void expect_refused(struct fixture *fixture)
{
    struct error error = {0};
    assert_false(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    assert_string_equal(error.field, "noise");
}

TEST(what_cannot_stop_by_error_is_refused)
{
    struct fixture *fixture = *state;
    half_noisy(fixture);
    fixture_commit(fixture);
    fixture->request.sampling.noise = LIMIT;
    fixture->request.comparison.compare = true;
    fixture->request.comparison.compare_with = fixture->request.tracing.tracer;
    expect_refused(fixture);
    fixture->request.comparison.compare = false;
    fixture->request.picture.view_source = VIEW_SOURCE_LAYERS;
    expect_refused(fixture);
}
