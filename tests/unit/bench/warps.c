/* SPDX-License-Identifier: MIT */
/* The benchmark's pictures of other eyes, of a plane that stands in front of a wall. Both face the eye, and the
 * eye moves such that both shift by whole pixels: the picture is known. A colour is the number of its pixel. */
#include "tests/bench/bench_warps.h"

#include "tests/harness/test.h"

#include <math.h>
#include <string.h>

#define WIDTH 64u
#define HEIGHT 48u
#define COUNT (WIDTH * HEIGHT)
#define FOCAL 32.0f /* pixels */
#define NEAR 2.0f   /* the plane; of the columns FIRST to END */
#define FAR 4.0f    /* the wall */
#define FIRST 20u
#define END 40u
#define ASIDE 0.25f /* metres: the plane shifts by 4 pixels, the wall by 2 */
#define NEAR_SHIFT 4u
#define FAR_SHIFT 2u
#define UNKNOWN UINT32_MAX

static uint32_t colours[COUNT];
static float w[COUNT];
static struct warp_picture picture;

static uint32_t colour_of(uint32_t pixel)
{
    return 0xff000000u | pixel;
}

static struct warp_view view_from(float right, float ahead)
{
    struct frame_camera camera = {.world_from_view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                                  .fov_y = 2 * atanf(0.5f * (float)HEIGHT / FOCAL)};
    struct warp_view view = {.width = WIDTH,
                             .height = HEIGHT,
                             .key_width = WIDTH,
                             .key_height = HEIGHT,
                             .from = camera,
                             .to = camera,
                             .radius = 0.15f,
                             .layer_count = 1};
    view.to.world_from_view[3] = right;
    view.to.world_from_view[11] = -ahead;
    view.layers[0] = (struct warp_layer){colours, w, NULL};
    return view;
}

static bool is_near(uint32_t x)
{
    return x >= FIRST && x < END;
}

static int begin(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < COUNT; i++) {
        colours[i] = colour_of(i);
        w[i] = is_near(i % WIDTH) ? 1 / NEAR : 1 / FAR;
    }
    return warp_picture_init(&picture, WIDTH, HEIGHT, COUNT) ? 0 : -1;
}

static int end(void **state)
{
    (void)state;
    warp_picture_finish(&picture);
    return 0;
}

EACH_TEST(begin, end)

/* The column that is seen at one from ASIDE. */
static uint32_t truth(uint32_t x)
{
    if (is_near(x + NEAR_SHIFT))
        return x + NEAR_SHIFT;
    return x + FAR_SHIFT < WIDTH && !is_near(x + FAR_SHIFT) ? x + FAR_SHIFT : UNKNOWN;
}

static void assert_is_true_picture(void)
{
    for (uint32_t i = 0; i < COUNT; i++) {
        const uint32_t from = truth(i % WIDTH);
        assert_int_equal(picture.seen[i], from != UNKNOWN);
        if (from != UNKNOWN)
            assert_int_equal(picture.colours[i], colour_of(i - i % WIDTH + from));
    }
}

TEST(a_point_lies_where_the_second_camera_projects_it)
{
    struct warp_view view = view_from(0.3f, -0.2f);
    const float c = 0.8f, s = 0.6f; /* turned about the vertical by asin(0.6) */
    const float turned[12] = {c, 0, s, 0.3f, 0, 1, 0, 0, -s, 0, c, 0.2f};
    memcpy(view.to.world_from_view, turned, sizeof(turned));
    const float point[3] = {-1.5f, 0.4f, -3}; /* world space */
    const float from[3] = {WIDTH / 2 + FOCAL * point[0] / 3, HEIGHT / 2 - FOCAL * point[1] / 3, 1.0f / 3};
    const float d[3] = {point[0] - 0.3f, point[1], point[2] - 0.2f};
    const float right = c * d[0] - s * d[2], ahead = -(s * d[0] + c * d[2]);
    float to[3];
    assert_true(warp_point(&view, from, to));
    /* floats of some tens: their rounding is some 1e-6 */
    assert_float_equal(to[0], WIDTH / 2 + FOCAL * right / ahead, 1e-4f);
    assert_float_equal(to[1], HEIGHT / 2 - FOCAL * d[1] / ahead, 1e-4f);
    assert_float_equal(to[2], 1 / ahead, 1e-6f);
    view = view_from(0, 5);
    assert_false(warp_point(&view, from, to));
}

TEST(the_picture_as_it_is_stays_and_counts_as_seen)
{
    const struct warp_view view = view_from(ASIDE, 0);
    warp_picture_make(&picture, &view, WARP_NONE);
    assert_memory_equal(picture.colours, colours, sizeof(colours));
    for (uint32_t i = 0; i < COUNT; i++)
        assert_int_equal(picture.seen[i], 1);
}

/* Half a turn about the axis of the view brings pixels onto pixels. */
TEST(rotation_alone_turns_the_picture_and_leaves_a_move_aside_out)
{
    struct warp_view view = view_from(ASIDE, 0);
    warp_picture_make(&picture, &view, WARP_ROTATION);
    assert_memory_equal(picture.colours, colours, sizeof(colours));
    view.to.world_from_view[0] = view.to.world_from_view[5] = -1;
    warp_picture_make(&picture, &view, WARP_ROTATION);
    for (uint32_t i = 0; i < COUNT; i++) {
        assert_int_equal(picture.seen[i], 1);
        assert_int_equal(picture.colours[i], colour_of(COUNT - 1 - i));
    }
}

/* An eighth to the right, of a focal length of half a picture: pixels that were beyond the border are not seen. */
TEST(rotation_alone_tells_what_is_beyond_the_border)
{
    struct warp_view view = view_from(0, 0);
    const float c = 0.70710678f, turned[12] = {c, 0, -c, 0, 0, 1, 0, 0, c, 0, c, 0};
    memcpy(view.to.world_from_view, turned, sizeof(turned));
    warp_picture_make(&picture, &view, WARP_ROTATION);
    const uint32_t middle = HEIGHT / 2 * WIDTH; /* the axis is at the border of what was seen */
    for (uint32_t x = 0; x < WIDTH; x++)
        assert_int_equal(picture.seen[middle + x], x < WIDTH / 2);
}

TEST(a_margin_is_cut_off_from_the_picture_as_it_is)
{
    struct warp_view view = view_from(ASIDE, 0);
    view.width = WIDTH - 8;
    view.height = HEIGHT - 4;
    warp_picture_make(&picture, &view, WARP_NONE);
    for (uint32_t i = 0; i < view.width * view.height; i++)
        assert_int_equal(picture.colours[i], colour_of((i / view.width + 2) * WIDTH + i % view.width + 4));
}

/* Of a key with a margin the inner part has the same focal length: both show the same. */
TEST(a_margin_brings_what_lies_beside_the_picture)
{
    struct warp_view view = view_from(ASIDE, 0);
    view.width = WIDTH - 2 * NEAR_SHIFT;
    view.to.fov_y = 2 * atanf(0.5f * (float)HEIGHT / FOCAL);
    static const enum warp_method methods[] = {WARP_SPLAT, WARP_SPLAT_BOTH, WARP_MESH};
    for (int k = 0; k < 3; k++) {
        warp_picture_make(&picture, &view, methods[k]);
        for (uint32_t i = 0; i < view.width * view.height; i++) {
            const uint32_t x = i % view.width + NEAR_SHIFT, from = truth(x);
            assert_int_equal(picture.seen[i], from != UNKNOWN);
            if (from != UNKNOWN)
                assert_int_equal(picture.colours[i], colour_of(i / view.width * WIDTH + from));
        }
    }
}

/* Pixels and vertices come to lie at centres of pixels, so that nothing is interpolated. */
TEST(splats_and_a_mesh_shift_near_and_far_and_tell_what_is_not_seen)
{
    const struct warp_view view = view_from(ASIDE, 0);
    static const enum warp_method methods[] = {WARP_SPLAT, WARP_SPLAT_BOTH, WARP_MESH};
    for (int k = 0; k < 3; k++) {
        warp_picture_make(&picture, &view, methods[k]);
        assert_is_true_picture();
    }
}

TEST(a_hole_has_the_colour_of_the_wall_beside_it)
{
    const struct warp_view view = view_from(ASIDE, 0);
    for (enum warp_method method = WARP_SPLAT; method <= WARP_MESH; method++) {
        warp_picture_make(&picture, &view, method);
        for (uint32_t y = 0; y < HEIGHT; y++)
            for (uint32_t x = END - NEAR_SHIFT; x < END - FAR_SHIFT; x++)
                assert_int_equal(picture.colours[y * WIDTH + x], colour_of(y * WIDTH + END));
    }
}

TEST(a_second_layer_is_seen_where_the_first_one_has_a_hole)
{
    static uint32_t behind[COUNT];
    static float behind_w[COUNT];
    struct warp_view view = view_from(ASIDE, 0);
    for (uint32_t i = 0; i < COUNT; i++) {
        behind[i] = colour_of(COUNT + i);
        behind_w[i] = 1 / FAR;
    }
    view.layer_count = 2;
    view.layers[1] = (struct warp_layer){behind, behind_w, NULL};
    for (enum warp_method method = WARP_SPLAT; method <= WARP_MESH; method++) {
        warp_picture_make(&picture, &view, method);
        for (uint32_t i = 0; i < COUNT; i++) {
            const uint32_t x = i % WIDTH;
            assert_int_equal(picture.seen[i], x + FAR_SHIFT < WIDTH);
            if (x >= END - NEAR_SHIFT && x < END - FAR_SHIFT)
                assert_int_equal(picture.colours[i], colour_of(COUNT + i + FAR_SHIFT));
        }
    }
}

/* Near an edge it may find either surface; elsewhere there is one solution alone. */
TEST(the_iteration_finds_what_lies_away_from_edges)
{
    const struct warp_view view = view_from(ASIDE, 0);
    uint32_t checked = 0;
    warp_picture_make(&picture, &view, WARP_ITERATIVE);
    for (uint32_t i = 0; i < COUNT; i++) {
        const uint32_t x = i % WIDTH, from = truth(x);
        const bool is_inside = x >= FIRST && x < END - 2 * NEAR_SHIFT,
                   is_outside = x + 2 * NEAR_SHIFT < FIRST || x > END;
        if (from == UNKNOWN || !(is_inside || is_outside))
            continue;
        assert_int_equal(picture.seen[i], 1);
        assert_int_equal(picture.colours[i], colour_of(i - x + from));
        checked++;
    }
    assert_true(checked > COUNT / 2);
    for (uint32_t y = 0; y < HEIGHT; y++)
        assert_int_equal(picture.seen[y * WIDTH + WIDTH - 1], 0);
}

/* A metre ahead the wall is larger by a third: of four rows and columns one is a crack. */
TEST(cracks_of_a_surface_that_comes_near_are_closed_both_ways_or_along_rows)
{
    const struct warp_view view = view_from(0, 1);
    for (uint32_t i = 0; i < COUNT; i++)
        w[i] = 1 / FAR;
    uint32_t seen[WARP_METHODS] = {0};
    for (enum warp_method method = WARP_SPLAT; method <= WARP_MESH; method++) {
        warp_picture_make(&picture, &view, method);
        for (uint32_t i = 0; i < COUNT; i++)
            seen[method] += picture.seen[i];
    }
    assert_int_equal(seen[WARP_MESH], COUNT);
    assert_int_equal(seen[WARP_SPLAT_BOTH], COUNT);
    assert_int_equal(seen[WARP_SPLAT], COUNT * 3 / 4);
}

TEST(the_environment_stays_where_it_is)
{
    const struct warp_view view = view_from(ASIDE, 0);
    memset(w, 0, sizeof(w));
    for (enum warp_method method = WARP_ITERATIVE; method <= WARP_MESH; method++) {
        warp_picture_make(&picture, &view, method);
        for (uint32_t y = 1; y + 1 < HEIGHT; y++)
            for (uint32_t x = 1; x + 1 < WIDTH; x++) {
                assert_int_equal(picture.seen[y * WIDTH + x], 1);
                assert_int_equal(picture.colours[y * WIDTH + x], colour_of(y * WIDTH + x));
            }
    }
}

TEST(a_difference_of_one_in_each_value_is_48_decibels)
{
    const uint32_t a[2] = {0xff102030u, 0xff000000u}, b[2] = {0x00112131u, 0xffffffffu};
    const uint8_t seen[2] = {1, 0};
    assert_float_equal(warp_psnr_db(a, b, seen, 2), 48.13, 0.01);
    assert_true(isinf(warp_psnr_db(a, a, NULL, 2)));
}
