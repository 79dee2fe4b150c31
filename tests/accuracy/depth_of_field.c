/* SPDX-License-Identifier: MIT */
/* A thin lens blurs what is out of focus as geometry says: every point becomes a disc, the circle of confusion. */
#include "tests/accuracy/render_fixture.h"
#include "tests/harness/test.h"

#define PI 3.14159265358979323846

enum { WIDTH = 64, HEIGHT = 32 };
#define EDGE_Z 1.0f /* the edge's plane; the eye is at z = 5 */

/* A white half plane, x > 0, in front of nothing. */
static void an_edge(struct fixture *fixture)
{
    struct scene_material *material = fixture_material(fixture);
    material->value.unlit = true;
    const float parent_from_node[12] = {1, 0, 0, 50, 0, 1, 0, 0, 0, 0, 1, EDGE_Z};
    fixture_square(fixture, 50.0f, material->base.id, parent_from_node);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 3.0f, 1.0f); /* so that there is no default sky */
    fixture->request.picture.width = WIDTH;
    fixture->request.picture.height = HEIGHT;
    fixture->request.sampling.samples = 256;
    fixture->request.sampling.pixel_filter = FILTER_BOX;
}

/* The share of a disc of radius 1 on the far side of a line at `t` from its middle. */
static double disc_share(double t)
{
    t = fmin(fmax(t, -1.0), 1.0);
    return 0.5 + (t * sqrt(1.0 - t * t) + asin(t)) / PI;
}

/* Share of the half plane that a pixel sees through a lens of radius `confusion` at the edge; `x`: left side
 * of the pixel there, `size`: its width there. */
static double pixel_share(double x, double size, double confusion)
{
    double sum = 0.0;
    for (int i = 0; i < 64; i++)
        sum += disc_share((x + size * (i + 0.5) / 64.0) / confusion) / 64.0;
    return sum;
}

/* `step`: width of a pixel in the edge's plane; `confusion`: radius of a point's disc there. */
static void expect_profile(struct fixture *fixture, const char *name, double step, double confusion)
{
    struct frame_result result = fixture_render(fixture);
    double squares = 0.0, maximum = 0.0;
    for (uint32_t x = 0; x < WIDTH; x++) {
        double mean = 0.0, expected = pixel_share((x - WIDTH / 2.0) * step, step, confusion);
        for (uint32_t y = 0; y < HEIGHT; y++)
            mean += (double)fixture_pixel(&result, x, y)[0] / HEIGHT;
        maximum = fmax(maximum, fabs(mean - expected));
        squares += (mean - expected) * (mean - expected) / WIDTH;
    }
    print_message("%s: blur of %.1f pixels, off by %.1e at most, %.1e rms\n", name, 2.0 * confusion / step,
                  maximum, sqrt(squares));
    frame_result_finish(&result);
    assert_true(2.0 * confusion / step > 8.0); /* else nothing is shown */
    /* 32 x 256 samples of a probability of a half differ by 1/2 / sqrt(8192) = 0.0055 if they are independent; of
     * 64 columns the worst is 2.7 of those off. Being stratified they are better. */
    assert_true(maximum < 0.015);
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(an_edge_before_and_behind_the_plane_in_focus_is_blurred_by_the_circle_of_confusion)
{
    struct fixture *fixture = *state;
    an_edge(fixture);
    const double distance = 4.0, aperture = 0.4, focus[2] = {2.5, 9.0};
    fixture->request.camera.fov_y = 0.2f;
    double step = 2.0 * tan(0.1) * distance / HEIGHT;
    for (int i = 0; i < 2; i++) {
        fixture->request.aperture = (float)aperture;
        fixture->request.focus = (float)focus[i];
        expect_profile(fixture, i ? "before the plane in focus" : "behind it", step,
                       aperture / 2.0 * fabs(1.0 - distance / focus[i]));
    }
}

TEST(an_orthographic_view_has_a_lens_too)
{
    struct fixture *fixture = *state;
    an_edge(fixture);
    fixture->request.camera.fov_y = 0.0f;
    fixture->request.camera.ortho_height = 1.0f;
    fixture->request.aperture = 0.8f;
    fixture->request.focus = 6.0f;
    expect_profile(fixture, "orthographic", 1.0 / HEIGHT, 0.4 * fabs(1.0 - 4.0 / 6.0));
}

TEST(what_is_in_focus_is_as_sharp_as_without_a_lens)
{
    struct fixture *fixture = *state;
    an_edge(fixture);
    fixture->request.tracing.primary = PRIMARY_TRACE;
    fixture->request.sampling.samples = 64;
    fixture->request.camera.fov_y = 0.2f;
    struct frame_result sharp = fixture_render(fixture);
    fixture->request.aperture = 0.5f;
    fixture->request.focus = 4.0f;
    struct frame_result in_focus = fixture_render(fixture);
    /* equal places in the pixels: all but those within rounding of the edge see the same */
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
        assert_near(fixture_pixel(&in_focus, i % WIDTH, i / WIDTH)[0],
                    fixture_pixel(&sharp, i % WIDTH, i / WIDTH)[0], 1.01 / 64.0);
    frame_result_finish(&in_focus);
    frame_result_finish(&sharp);
}

TEST(without_a_focal_distance_the_middle_of_the_scene_is_in_focus)
{
    struct fixture *fixture = *state;
    struct scene_material *material = fixture_material(fixture);
    fixture_sphere(fixture, 0.5f, 0.0f, -2.0f, 0.5f, material->base.id);
    fixture_sphere(fixture, -0.5f, 0.0f, 2.0f, 0.5f, material->base.id);
    fixture->request.aperture = 0.3f;
    fixture->request.sampling.samples = 4;
    struct frame_result open = fixture_render(fixture);
    fixture->request.focus = 5.0f;
    struct frame_result stated = fixture_render(fixture);
    assert_memory_equal(open.pixels, stated.pixels, open.size_bytes);
    frame_result_finish(&stated);
    fixture->request.focus = 3.0f;
    stated = fixture_render(fixture);
    assert_memory_not_equal(open.pixels, stated.pixels, open.size_bytes);
    frame_result_finish(&open);
    frame_result_finish(&stated);
}

TEST(nothing_before_the_near_plane_is_seen_through_a_lens)
{
    struct fixture *fixture = *state;
    struct scene_material *material = fixture_material(fixture);
    material->value.unlit = true;
    fixture_square(fixture, 50.0f, material->base.id, NULL);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 3.0f, 1.0f);
    fixture->request.aperture = 2.0f;
    fixture->request.focus = 1.0f; /* rays slant by as much as 45 degrees and more */
    fixture->request.camera.fov_y = 1.0f;
    fixture->request.sampling.samples = 16;
    for (int beyond = 0; beyond < 2; beyond++) {
        fixture->request.camera.near = beyond ? 5.001f : 4.999f;
        struct frame_result result = fixture_render(fixture);
        for (uint32_t i = 0; i < 32 * 32; i++)
            assert_near(fixture_pixel(&result, i % 32, i / 32)[3], beyond ? 0.0 : 1.0, 0.0);
        frame_result_finish(&result);
    }
}
