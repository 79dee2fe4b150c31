/* SPDX-License-Identifier: MIT */
/* The integrator `path` in closed rooms that glow, where energy is known. */
#include "tests/accuracy/path_fixture.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/harness/test.h"

/* ---- closed rooms ---- */

/* A box of squares about the eye, 2 m wide, everywhere of one albedo and with an emission of 1. Its material has a
 * mask that cuts nothing out, so its triangles are not sampled as lights, and every path brings the same. */
static void a_glowing_room(struct fixture *fixture, float albedo)
{
    static const float walls[6][12] = {
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1}, {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 1},
        {0, 0, 1, -1, 1, 0, 0, 0, 0, 1, 0, 0}, {0, 0, -1, 1, 1, 0, 0, 0, 0, -1, 0, 0},
        {0, 1, 0, 0, 0, 0, 1, -1, 1, 0, 0, 0}, {0, -1, 0, 0, 0, 0, -1, 1, 1, 0, 0, 0},
    };
    struct scene_material *material = fixture_material(fixture);
    for (int c = 0; c < 3; c++) {
        material->value.base_colour[c] = albedo;
        material->value.emission[c] = 1.0f;
    }
    material->value.alpha_mode = ALPHA_MASK;
    for (int i = 0; i < 6; i++)
        fixture_square(fixture, 1.0f, material->base.id, walls[i]);
    fixture_set_camera(fixture, 0.4f, 0.2f, 0.7f, 1.2f);
}

/* Light that was reflected up to n times: 1 + a + .. + a^n. */
static double room_radiance(double albedo, uint32_t depth)
{
    return (1.0 - pow(albedo, depth + 1)) / (1.0 - albedo);
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(a_room_that_glows_has_the_sum_of_its_reflections)
{
    struct fixture *fixture = *state;
    static const unsigned tracers[] = {TRACER_BVH, TRACER_NAIVE, TRACER_REFERENCE};
    static const float albedos[] = {0.8f, 0.9f, 1.0f}; /* after 3 bounces more than the half is left */
    for (size_t t = 0; t < (getenv("FARLIGHT_TEST_LONG") ? COUNT(tracers) : 1); t++)
        for (size_t a = 0; a < COUNT(albedos); a++)
            for (uint32_t depth = 0; depth <= 3; depth++) { /* depths at which no path ends by chance */
                path_begin(fixture, tracers[t], depth);
                a_glowing_room(fixture, albedos[a]);
                fixture->request.sampling.samples = 4;
                struct frame_result result = fixture_render(fixture);
                double radiance = albedos[a] == 1.0f ? depth + 1.0 : room_radiance((double)albedos[a], depth);
                for (uint32_t i = 0; i < PIXELS; i++) /* every path brings just that; roundings */
                    assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[1], radiance, 2e-5);
                frame_result_finish(&result);
            }
}

TEST(paths_that_end_by_chance_bring_as_much_in_the_mean)
{
    struct fixture *fixture = *state;
    static const float albedos[] = {0.3f, 0.6f, 0.9f};
    for (size_t a = 0; a < COUNT(albedos); a++) {
        path_begin(fixture, TRACER_BVH, 32);
        a_glowing_room(fixture, albedos[a]);
        fixture->request.sampling.samples = 16;
        struct frame_result result = fixture_render(fixture);
        struct mean mean = mean_of_picture(&result);
        double radiance = room_radiance((double)albedos[a], 32);
        double rays = (double)result.secondary_rays / (PIXELS * 16.0);
        print_message("albedo %g: %.4f (standard error %.1e), should be %.4f; %.1f rays a path of 32\n",
                      (double)albedos[a], mean.value, mean.error, radiance, rays);
        assert_mean(mean, radiance, 1e-4);
        assert_true(mean.error > 0.0 && mean.error < 0.02 * radiance);
        assert_true(rays < 16.0); /* else nothing ended */
        frame_result_finish(&result);
    }
}

TEST(a_path_that_carries_nothing_has_no_ray)
{
    struct fixture *fixture = *state;
    static const unsigned integrators[] = {INTEGRATOR_PATH, INTEGRATOR_DISTRIBUTED, INTEGRATOR_WHITTED};
    for (size_t k = 0; k < COUNT(integrators); k++)
        for (int black = 0; black < 2; black++) {
            path_begin(fixture, TRACER_BVH, 3);
            a_glowing_room(fixture, black ? 0.0f : 0.8f); /* no path is ended by chance */
            fixture->request.light.integrator = integrators[k];
            struct frame_result result = fixture_render(fixture);
            /* Scattered rays are of paths alone. */
            const uint32_t bounces = !black && integrators[k] == INTEGRATOR_PATH ? 3 : 0;
            assert_int_equal(result.secondary_rays, bounces * PIXELS);
            assert_true(!black || result.shadow_rays == 0); /* by default a sky is asked for light */
            frame_result_finish(&result);
        }
}

/* ---- frames ---- */

static void assert_same(const struct frame_result *a, const struct frame_result *b)
{
    assert_int_equal(a->size_bytes, b->size_bytes);
    assert_memory_equal(a->pixels, b->pixels, a->size_bytes);
    assert_int_equal(a->samples, b->samples);
}

/* Light that a diffuse surface scatters goes in all directions, light that a mirror reflects hardly does;
 * waves of less than 1024 hits are not sorted. */
TEST(waves_are_sorted_where_their_directions_differ_and_the_picture_stays_the_same)
{
    struct fixture *fixture = *state;
    for (int mirrors = 0; mirrors < 2; mirrors++) {
        path_begin(fixture, TRACER_BVH, 3);
        a_glowing_room(fixture, 0.7f);
        struct scene_material *material = &fixture->edits[0].set.material;
        material->value.metallic = (float)mirrors;
        material->value.roughness = mirrors ? 0.0f : 1.0f;
        fixture->request.picture.width = fixture->request.picture.height = 64;
        struct frame_result whole = fixture_render(fixture);
        frame_renderer_queue_ahead(fixture->renderer, true);
        struct frame_result ahead = fixture_render(fixture);
        frame_renderer_queue_ahead(fixture->renderer, false);
        frame_renderer_set_capacity(fixture->renderer, 1000, 1000);
        struct frame_result cut = fixture_render(fixture);
        assert_int_equal(whole.sorted_waves, mirrors ? 0 : 3); /* the last wave has no children */
        assert_int_equal(ahead.sorted_waves, whole.sorted_waves);
        assert_int_equal(cut.sorted_waves, 0);
        assert_same(&whole, &cut);
        assert_same(&whole, &ahead);
        frame_result_finish(&whole);
        frame_result_finish(&ahead);
        frame_result_finish(&cut);
    }
}
