/* SPDX-License-Identifier: MIT */
/* Pictures of other eyes beside closed forms. */
#include "tests/unit/warp/views.h"

static struct made made, other;

/* w of a plane in texel coordinates. */
static double plane_w(const double plane[3], double x, double y)
{
    return plane[0] + plane[1] * x + plane[2] * y;
}

static void set_plane(const double plane[3])
{
    for (uint32_t i = 0; i < COUNT; i++) {
        key_w[0][i] = (float)plane_w(plane, i % WIDTH + 0.5, i / WIDTH + 0.5);
        key_colours[0][i] = place_colour(i % WIDTH, i / WIDTH);
    }
}

/* A near plane in front of a wall, both facing the eye, whose colours are random. */
#define NEAR_LEFT 120u
#define NEAR_RIGHT 180u

static bool is_near(uint32_t x)
{
    return x >= NEAR_LEFT && x < NEAR_RIGHT;
}

static void set_screen(void)
{
    uint64_t seed = 3;
    for (uint32_t i = 0; i < COUNT; i++) {
        key_w[0][i] = is_near(i % WIDTH) ? 0.5f : 0.125f;
        key_colours[0][i] = random_bits(&seed);
    }
}

TEST(the_same_camera_gives_the_same_picture_bit_for_bit)
{
    uint64_t seed = 1;
    for (uint32_t i = 0; i < COUNT; i++) {
        key_colours[0][i] = random_bits(&seed);
        key_w[0][i] = random_bits(&seed) % 4 == 0 ? 0 : (float)uniform(&seed, 0.01, 5);
    }
    const struct fl_warp_key key = key_of(1);
    struct fl_warp *warp = warp_with(1, &key);
    for (enum fl_warp_quality quality = FL_WARP_TREE; quality <= FL_WARP_ITERATIVE; quality++) {
        const struct fl_warp_view view = view_of(key.camera, quality);
        make(warp, &view, &made);
        assert_memory_equal(made.colours, key_colours[0], sizeof(made.colours));
        for (uint32_t i = 0; i < COUNT; i++)
            assert_int_equal(made.mask[i], FL_WARP_KNOWN);
        assert_true(made.counts.known == 1 && made.counts.behind == 0 && made.counts.outside == 0);
    }
    fl_warp_destroy(warp);
}

/* Weights are rounded to 1 / 256 of a texel along both axes, and values twice: half a level each. */
#define FILTER_LEVELS 2.1

TEST(a_rotation_alone_equals_resampling)
{
    const struct fl_warp_camera camera = camera_turned(0.07, -0.04);
    uint32_t known = 0;
    set_plane((const double[3]){0.4, 0, 0});
    const struct fl_warp_key key = key_of(1);
    struct fl_warp *warp = warp_with(1, &key);
    const float *m = camera.world_from_view;
    for (enum fl_warp_quality quality = FL_WARP_TREE; quality <= FL_WARP_ITERATIVE; quality++) {
        const struct fl_warp_view view = view_of(camera, quality);
        make(warp, &view, &made);
        for (uint32_t i = 0; i < COUNT; i++) {
            const double view_x = (i % WIDTH + 0.5 - WIDTH / 2.0) / FOCAL,
                         view_y = (HEIGHT / 2.0 - i / WIDTH - 0.5) / FOCAL;
            double d[3];
            for (int k = 0; k < 3; k++)
                d[k] = m[4 * k] * view_x + m[4 * k + 1] * view_y - m[4 * k + 2];
            const double x = WIDTH / 2.0 - FOCAL * d[0] / d[2], y = HEIGHT / 2.0 + FOCAL * d[1] / d[2];
            if (x < 0.5 || y < 0.5 || x > WIDTH - 0.5 || y > HEIGHT - 0.5)
                continue;
            assert_int_equal(made.mask[i], FL_WARP_KNOWN);
            assert_float_equal(red_of(made.colours[i]), wave_at(x), FILTER_LEVELS);
            assert_float_equal(green_of(made.colours[i]), wave_at(y), FILTER_LEVELS);
            known++;
        }
    }
    assert_true(known > COUNT); /* known in two pictures */
    fl_warp_destroy(warp);
}

/* Where the ray of a pixel meets a plane, in texels; w too. */
static void meet_plane(const double plane[3], const struct fl_warp_camera *camera, uint32_t pixel, double place[3])
{
    const float *m = camera->world_from_view;
    const double view_x = (pixel % WIDTH + 0.5 - WIDTH / 2.0) / FOCAL;
    const double view_y = (HEIGHT / 2.0 - pixel / WIDTH - 0.5) / FOCAL;
    /* Homogeneous texel coordinates of the direction, and of the eye. */
    double d[3], e[3], a[3], b[3];
    for (int k = 0; k < 3; k++) {
        d[k] = m[4 * k] * view_x + m[4 * k + 1] * view_y - m[4 * k + 2];
        e[k] = m[4 * k + 3];
    }
    a[0] = FOCAL * d[0] - WIDTH / 2.0 * d[2];
    a[1] = -FOCAL * d[1] - HEIGHT / 2.0 * d[2];
    a[2] = -d[2];
    b[0] = FOCAL * e[0] - WIDTH / 2.0 * e[2];
    b[1] = -FOCAL * e[1] - HEIGHT / 2.0 * e[2];
    b[2] = -e[2];
    const double over_eye = 1 - (plane[1] * b[0] + plane[2] * b[1] + plane[0] * b[2]);
    const double u = (plane[1] * a[0] + plane[2] * a[1] + plane[0] * a[2]) / over_eye, z = a[2] + u * b[2];
    place[0] = (a[0] + u * b[0]) / z;
    place[1] = (a[1] + u * b[1]) / z;
    place[2] = u / z;
}

/* Tolerance for colours that change by 255 from texel to texel: 1 / 64 pixel. */
#define PLACE_LEVELS (255.0 / 64)

TEST(a_plane_equals_its_homography_to_a_64th_of_a_pixel)
{
    const double planes[][3] = {{0.3, 0, 0}, {0.1, 0.001, 0.0005}, {0.9, -0.0015, -0.001}, {0.02, 0.0001, 0.0025}};
    struct fl_warp_camera camera = camera_turned(0.02, 0.03);
    camera.world_from_view[3] = 0.1f;
    camera.world_from_view[7] = -0.05f;
    camera.world_from_view[11] = -0.06f;
    for (size_t p = 0; p < sizeof(planes) / sizeof(planes[0]); p++) {
        uint32_t known = 0;
        set_plane(planes[p]);
        struct fl_warp_key key = key_of(1);
        key.pixels = 1.0f / 64;
        struct fl_warp *warp = warp_with(1, &key);
        const struct fl_warp_view view = view_of(camera, FL_WARP_TREE);
        make(warp, &view, &made);
        for (uint32_t i = 0; i < COUNT; i++) {
            double place[3];
            meet_plane(planes[p], &camera, i, place);
            if (place[0] < 1 || place[1] < 1 || place[0] > WIDTH - 1 || place[1] > HEIGHT - 1)
                continue;
            assert_int_equal(made.mask[i], FL_WARP_KNOWN);
            assert_float_equal(red_of(made.colours[i]), wave_at(place[0]), PLACE_LEVELS);
            assert_float_equal(green_of(made.colours[i]), wave_at(place[1]), PLACE_LEVELS);
            known++;
        }
        assert_true(known > COUNT / 2);
        fl_warp_destroy(warp);
    }
}

/* 10 cm to the right: the near plane, 2 m away, shifts by 10 texels, the wall, 8 m away, by 2.5. */
#define ASIDE 0.1
#define NEAR_SHIFT 10u

TEST(the_mask_says_what_lies_behind_and_outside)
{
    set_screen();
    const struct fl_warp_key key = key_of(1);
    struct fl_warp *warp = warp_with(1, &key);
    const struct fl_warp_view view = view_of(camera_at(ASIDE, 0, 0), FL_WARP_TREE);
    make(warp, &view, &made);
    uint32_t counts[3] = {0};
    for (uint32_t i = 0; i < COUNT; i++) {
        const uint32_t x = i % WIDTH;
        counts[made.mask[i]]++;
        /* The near plane hides nothing on its left; on its right 7.5 columns of the wall have not been seen. Its
         * last column and the wall's first one may be either. */
        if (x >= NEAR_LEFT - NEAR_SHIFT && x < NEAR_RIGHT - NEAR_SHIFT) {
            assert_int_equal(made.colours[i], key_colours[0][i + NEAR_SHIFT]);
            assert_int_equal(made.mask[i], FL_WARP_KNOWN);
        }
        if (x >= NEAR_RIGHT - NEAR_SHIFT && x < NEAR_RIGHT - 3)
            assert_int_equal(made.mask[i], FL_WARP_BEHIND);
        if (x < NEAR_LEFT - NEAR_SHIFT || (x > NEAR_RIGHT - 2 && x < WIDTH - 3))
            assert_int_equal(made.mask[i], FL_WARP_KNOWN);
        if (x > WIDTH - 3)
            assert_int_equal(made.mask[i], FL_WARP_OUTSIDE);
    }
    assert_float_equal(made.counts.known, (double)counts[FL_WARP_KNOWN] / COUNT, 1e-6);
    assert_float_equal(made.counts.behind, (double)counts[FL_WARP_BEHIND] / COUNT, 1e-6);
    assert_float_equal(made.counts.outside, (double)counts[FL_WARP_OUTSIDE] / COUNT, 1e-6);
    assert_float_equal(made.counts.bound_pixels, 0.25, 1e-6);
    assert_true(made.counts.deeper == 0 && made.counts.processor_ns > 0);
    fl_warp_destroy(warp);
}

TEST(a_hole_has_the_colour_of_the_background_and_a_pattern_if_that_is_wanted)
{
    set_screen();
    for (uint32_t i = 0; i < COUNT; i++)
        key_colours[0][i] = is_near(i % WIDTH) ? 0xff2040ffu : 0xffff8000u;
    const struct fl_warp_key key = key_of(1);
    struct fl_warp *warp = warp_with(1, &key);
    struct fl_warp_view view = view_of(camera_at(ASIDE, 0, 0), FL_WARP_TREE);
    make(warp, &view, &made);
    view.holes = FL_WARP_PATTERN;
    make(warp, &view, &other);
    for (uint32_t i = 0; i < COUNT; i++) {
        const uint32_t x = i % WIDTH;
        if (x >= NEAR_RIGHT - NEAR_SHIFT && x < NEAR_RIGHT - 3)
            assert_int_equal(made.colours[i], 0xffff8000u);
        assert_int_equal(made.mask[i], other.mask[i]);
        assert_true((made.colours[i] == other.colours[i]) == (made.mask[i] == FL_WARP_KNOWN));
        assert_int_equal(other.colours[i] >> 24, 255);
    }
    fl_warp_destroy(warp);
}

/* Share of the red in the fill beside the wall. */
static double smear_in_holes(bool is_smeared)
{
    struct fl_warp_key key = key_of(1);
    key.is_smeared = is_smeared;
    struct fl_warp *warp = warp_with(1, &key);
    const struct fl_warp_view view = view_of(camera_at(ASIDE, 0, 0), FL_WARP_TREE);
    double sum = 0;
    make(warp, &view, &made);
    for (uint32_t i = 0; i < COUNT; i++)
        sum += i % WIDTH >= NEAR_RIGHT - NEAR_SHIFT && i % WIDTH < NEAR_RIGHT - 3 ? red_of(made.colours[i]) : 0;
    fl_warp_destroy(warp);
    return sum;
}

/* The edge's red runs one texel into the wall, which has none: a bilinear filter half a texel further from its
 * middle has half of it. */
TEST(holes_take_less_of_what_runs_over_an_edge)
{
    set_screen();
    for (uint32_t i = 0; i < COUNT; i++)
        key_colours[0][i] = is_near(i % WIDTH) || i % WIDTH == NEAR_RIGHT ? 0xff0000ffu : 0xffff8000u;
    const double as_it_is = smear_in_holes(false), mended = smear_in_holes(true);
    assert_true(as_it_is > 0 && mended < 0.6 * as_it_is);
}

/* The known part of the mask is as in the test above; unknown pixels have share 0. Left of the near plane's
 * place the iteration may find it or the wall. */
TEST(what_sticks_moves_with_its_texels)
{
    static uint8_t given[COUNT], sticking[COUNT];
    set_screen();
    for (uint32_t i = 0; i < COUNT; i++)
        given[i] = (uint8_t)(is_near(i % WIDTH) ? 55 + i % 200 : 10);
    struct fl_warp_key key = key_of(1);
    key.layers[0].sticking = given;
    struct fl_warp *warp = warp_with(1, &key);
    struct fl_warp_error error = {0};
    struct fl_warp_picture picture = {.colours = made.colours, .mask = made.mask, .sticking = sticking};
    for (enum fl_warp_quality quality = FL_WARP_TREE; quality <= FL_WARP_ITERATIVE; quality++) {
        const struct fl_warp_view view = view_of(camera_at(ASIDE, 0, 0), quality);
        const uint32_t left = quality == FL_WARP_TREE ? NEAR_LEFT - NEAR_SHIFT : NEAR_LEFT;
        double sum = 0;
        assert_true(fl_warp_make(warp, &view, &picture, &error));
        for (uint32_t i = 0; i < COUNT; i++) {
            const uint32_t x = i % WIDTH;
            sum += sticking[i];
            if (x >= left && x < NEAR_RIGHT - NEAR_SHIFT - 1) /* its last column may be the wall */
                assert_int_equal(sticking[i], given[i + NEAR_SHIFT]);
            else if (made.mask[i] != FL_WARP_KNOWN)
                assert_int_equal(sticking[i], 0);
            else if (x < NEAR_LEFT - NEAR_SHIFT - 1 || x > NEAR_RIGHT)
                assert_int_equal(sticking[i], 10);
        }
        assert_true(fabs((double)picture.counts.sticking - sum / (255.0 * COUNT)) < 1e-6);
    }
    fl_warp_destroy(warp);
}

TEST(a_part_that_comes_without_marks_does_not_stick)
{
    static uint8_t given[COUNT], sticking[COUNT];
    set_plane((const double[3]){0.4, 0, 0});
    memset(given, 255, sizeof(given));
    struct fl_warp_key key = key_of(1);
    struct fl_warp *warp = warp_with(1, &key);
    struct fl_warp_error error = {0};
    struct fl_warp_picture picture = {.colours = made.colours, .mask = made.mask, .sticking = sticking};
    const struct fl_warp_view view = view_of(key.camera, FL_WARP_TREE);
    struct fl_warp_part part = {
        .width = WIDTH, .height = 20, .texels = {.colours = key_colours[0], .w = key_w[0], .sticking = given}};
    assert_true(fl_warp_make(warp, &view, &picture, &error) && picture.counts.sticking == 0);
    assert_true(fl_warp_update(warp, &part, &error));
    part.height = 10;
    part.texels.sticking = NULL;
    assert_true(fl_warp_update(warp, &part, &error) && fl_warp_make(warp, &view, &picture, &error));
    for (uint32_t i = 0; i < COUNT; i++)
        assert_int_equal(sticking[i], i / WIDTH >= 10 && i / WIDTH < 20 ? 255 : 0);
    assert_float_equal(picture.counts.sticking, 10.0 / HEIGHT, 1e-6);
    /* Nor do those of another key. */
    assert_true(fl_warp_set_key(warp, &key, &error) && fl_warp_make(warp, &view, &picture, &error));
    assert_true(picture.counts.sticking == 0);
    fl_warp_destroy(warp);
}

TEST(no_colour_crosses_the_edge_of_a_surface)
{
    set_screen();
    for (uint32_t i = 0; i < COUNT; i++)
        key_colours[0][i] = is_near(i % WIDTH) ? 0xff0000ffu : 0xff00ff00u;
    const struct fl_warp_key key = key_of(1);
    struct fl_warp *warp = warp_with(1, &key);
    for (int k = -8; k <= 8; k++) {
        struct fl_warp_camera camera = camera_turned(0.01 * k, 0.007 * k);
        camera.world_from_view[3] = 0.0137f * (float)k;
        camera.world_from_view[11] = 0.009f * (float)k;
        for (enum fl_warp_quality quality = FL_WARP_TREE; quality <= FL_WARP_ITERATIVE; quality++) {
            const struct fl_warp_view view = view_of(camera, quality);
            make(warp, &view, &made);
            for (uint32_t i = 0; i < COUNT; i++)
                assert_true(made.colours[i] == 0xff0000ffu || made.colours[i] == 0xff00ff00u);
        }
    }
    fl_warp_destroy(warp);
}

TEST(the_next_layer_is_seen_where_the_first_one_hides_it)
{
    uint64_t seed = 9;
    set_screen();
    for (uint32_t i = 0; i < COUNT; i++) {
        key_w[1][i] = is_near(i % WIDTH) ? 0.125f : 0; /* the wall behind the near plane */
        key_colours[1][i] = random_bits(&seed);
    }
    const struct fl_warp_key key = key_of(2);
    struct fl_warp *warp = warp_with(1, &key);
    /* Twice as far, so that the wall shifts by whole texels too: 5, and the near plane by 20. */
    const struct fl_warp_view view = view_of(camera_at(2 * ASIDE, 0, 0), FL_WARP_TREE);
    make(warp, &view, &made);
    uint32_t deeper = 0;
    for (uint32_t i = 0; i < COUNT; i++) {
        const uint32_t x = i % WIDTH;
        if (x < NEAR_RIGHT - 2 * NEAR_SHIFT || x >= NEAR_RIGHT - 5)
            continue;
        assert_int_equal(made.mask[i], FL_WARP_KNOWN);
        assert_int_equal(made.colours[i], key_colours[1][i + 5]);
        deeper++;
    }
    assert_int_equal(deeper, 15 * HEIGHT);
    assert_float_equal(made.counts.deeper, (double)deeper / COUNT, 1e-6);
    assert_true(made.counts.behind == 0);
    fl_warp_destroy(warp);
}

TEST(the_environment_is_infinitely_far_away)
{
    uint64_t seed = 5;
    for (uint32_t i = 0; i < COUNT; i++) {
        key_w[0][i] = 0;
        key_colours[0][i] = random_bits(&seed);
    }
    const struct fl_warp_key key = key_of(1);
    struct fl_warp *warp = warp_with(1, &key);
    for (enum fl_warp_quality quality = FL_WARP_TREE; quality <= FL_WARP_ITERATIVE; quality++) {
        const struct fl_warp_view view = view_of(camera_at(3, -2, 1), quality);
        make(warp, &view, &made);
        assert_true(made.counts.known == 1);
        assert_true(isinf(made.counts.bound_pixels));
    }
    fl_warp_destroy(warp);
}

TEST(a_picture_may_have_any_size_and_field_of_view)
{
    static uint32_t colours[37 * 23];
    static uint8_t mask[37 * 23];
    set_plane((const double[3]){0.3, 0, 0});
    for (uint32_t i = 0; i < COUNT; i++)
        key_colours[0][i] = 0xff336699u;
    const struct fl_warp_key key = key_of(1);
    struct fl_warp *warp = warp_with(1, &key);
    for (uint32_t width = 1; width <= 37; width += 6)
        for (uint32_t height = 1; height <= 23; height += 11) {
            struct fl_warp_view view = {.width = width, .height = height, .camera = camera_at(0.01, 0, 0)};
            struct fl_warp_picture picture = {.colours = colours, .mask = mask};
            struct fl_warp_error error = {0};
            view.camera.fov_y = 0.01f * (float)height;
            memset(mask, 99, sizeof(mask));
            assert_true(fl_warp_make(warp, &view, &picture, &error));
            for (uint32_t i = 0; i < sizeof(mask); i++) {
                assert_int_equal(mask[i], i < width * height ? FL_WARP_KNOWN : 99);
                if (i < width * height)
                    assert_int_equal(colours[i], 0xff336699u);
            }
        }
    fl_warp_destroy(warp);
}

/* Several surfaces with edges, three layers. */
static void set_rubble(void)
{
    uint64_t seed = 11;
    for (uint32_t l = 0; l < FL_WARP_LAYERS_MAX; l++)
        for (uint32_t i = 0; i < COUNT; i++) {
            const uint32_t cell = i % WIDTH / 23 + i / WIDTH / 17 * 14 + l * 171;
            key_w[l][i] = (float)((cell * 37 % 11) * 0.05 + 0.0007 * (i % 23));
            key_colours[l][i] = random_bits(&seed);
        }
}

TEST(several_threads_make_the_picture_that_one_makes)
{
    set_rubble();
    const struct fl_warp_key key = key_of(3);
    struct fl_warp *one = warp_with(1, &key);
    for (unsigned threads = 2; threads <= 5; threads++) {
        struct fl_warp *many = warp_with(threads, &key);
        for (enum fl_warp_quality quality = FL_WARP_TREE; quality <= FL_WARP_ITERATIVE; quality++)
            for (int k = 0; k < 20; k++) {
                const struct fl_warp_view view = view_of(camera_at(0.01 * k, -0.003 * k, 0.005 * k), quality);
                make(one, &view, &made);
                make(many, &view, &other);
                assert_memory_equal(made.colours, other.colours, sizeof(made.colours));
                assert_memory_equal(made.mask, other.mask, sizeof(made.mask));
                assert_true(made.counts.known == other.counts.known && made.counts.deeper == other.counts.deeper);
            }
        fl_warp_destroy(many);
    }
    fl_warp_destroy(one);
}
