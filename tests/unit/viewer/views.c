/* SPDX-License-Identifier: MIT */
/* The thread that makes views: which ones come out, from which picture and of which camera. */
#include "viewer/view/views.h"
#include "viewer/view/warped_key.h"
#include "tests/harness/test.h"
#include "protocol/common/clock.h"

#include <math.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>

#define EDGE 64
#define PATIENCE_NS UINT64_C(60000000000) /* on a busy machine */

static struct fl_warp_camera camera_at(float x)
{
    return (struct fl_warp_camera){.world_from_view = {1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0}, .fov_y = 1};
}

/* A wall of one grey, two metres away. */
static struct views_key some_key(uint8_t grey)
{
    struct fl_error error;
    struct views_key key = {.camera = camera_at(0), .radius = 0.2f, .is_final = true};
    assert_true(pixmap_resize(&key.picture, EDGE, EDGE, &error));
    memset(key.picture.pixels, grey, EDGE * EDGE * 4);
    key.depth = malloc(EDGE * EDGE * sizeof(*key.depth));
    assert_non_null(key.depth);
    for (int i = 0; i < EDGE * EDGE; i++)
        key.depth[i] = 2;
    return key;
}

static struct views *views;
static struct pixmap picture; /* and what is said of it: those that came last */
static struct views_made made;

static int begin(void **state)
{
    (void)state;
    struct fl_error error;
    made = (struct views_made){0};
    views = views_create(&error);
    return views ? 0 : -1;
}

static int end(void **state)
{
    (void)state;
    pixmap_finish(&picture);
    views_destroy(views);
    return 0;
}

EACH_TEST(begin, end)

static uint64_t start_of_size(uint32_t width, uint32_t height, float x)
{
    const struct views_request request = {
        .width = width, .height = height, .camera = camera_at(x), .frame_ns = 1000000};
    return views_start(views, &request);
}

static uint64_t start(float x)
{
    return start_of_size(EDGE, EDGE, x);
}

static void wait_for_one(void)
{
    const uint64_t end_ns = monotonic_now_ns() + PATIENCE_NS;
    while (!views_take(views, &picture, &made)) {
        assert_true(monotonic_now_ns() < end_ns);
        poll(NULL, 0, 1);
    }
}

static int grey(void)
{
    return picture.pixels[(EDGE / 2 * EDGE + EDGE / 2) * 4];
}

/* A picture that comes may make the last view the best without another one. */
static void wait_for_best(uint64_t request)
{
    const uint64_t end_ns = monotonic_now_ns() + PATIENCE_NS;
    while (views_take(views, &picture, &made) || !views_is_best(views, &made, request)) {
        assert_true(monotonic_now_ns() < end_ns);
        poll(NULL, 0, 1);
    }
}

TEST(a_view_is_of_the_newest_picture_and_the_newest_camera)
{
    struct views_key key = some_key(100);
    const uint64_t first = start(0);
    assert_false(views_take(views, &picture, &made)); /* there is no picture yet */
    key.sticking = malloc(EDGE * EDGE);
    assert_non_null(key.sticking);
    memset(key.sticking, 51, EDGE * EDGE); /* a fifth */
    views_give_key(views, &key);
    assert_true(!key.depth && !key.sticking && !key.picture.pixels); /* taken over */
    wait_for_best(first);
    assert_true(made.request == first && made.quality == FL_WARP_TREE);
    assert_true(picture.width == EDGE && picture.height == EDGE && grey() == 100);
    assert_true(made.counts.known > 0.99f);
    assert_float_equal(made.counts.sticking, 0.2f, 0.01f);
    /* A newer camera, a newer picture: each makes another view, at last of both. */
    const uint64_t second = start(0.1f);
    key = some_key(50);
    views_give_key(views, &key);
    assert_false(views_is_best(views, &made, first));
    wait_for_best(second);
    assert_int_equal(grey(), 50);
    assert_true(made.counts.outside > 0.01f); /* the wall's right edge was not seen */
}

/* Nearer than the wall, in the middle of it. */
static bool is_post(int i)
{
    return i % EDGE >= EDGE * 3 / 8 && i % EDGE < EDGE * 5 / 8;
}

TEST(what_a_picture_hides_is_seen_once_it_has_come)
{
    struct views_key key = some_key(100);
    key.is_moving = true;
    key.is_final = false;
    for (int i = 0; i < EDGE * EDGE; i++)
        key.depth[i] = is_post(i) ? 0.5f : 2;
    views_give_key(views, &key);
    const uint64_t request = start(0.05f);
    wait_for_best(request);
    assert_true(made.layers == 1 && made.counts.behind > 0.01f);
    /* The wall behind the post. */
    struct views_key like = some_key(200);
    struct views_layer layer = {like.picture, like.depth};
    for (int i = 0; i < EDGE * EDGE; i++)
        layer.depth[i] = is_post(i) ? 2 : 0;
    views_give_layer(views, &layer);
    assert_true(!layer.depth && !layer.picture.pixels);
    assert_false(views_is_best(views, &made, request));
    wait_for_best(request);
    assert_true(made.layers == 2 && made.counts.behind == 0 && made.counts.deeper > 0.01f);
    /* A second one, of half the size: one of its pixels for two by two. */
    like = some_key(200);
    layer = (struct views_layer){like.picture, like.depth};
    layer.picture.width = layer.picture.height = EDGE / 2;
    for (int i = 0; i < EDGE / 2 * (EDGE / 2); i++)
        layer.depth[i] = 3;
    views_give_layer(views, &layer);
    wait_for_best(request);
    assert_int_equal(made.layers, 3);
    /* A new key has none; one of another size is not of it. */
    key = some_key(100);
    views_give_key(views, &key);
    like = some_key(200);
    layer = (struct views_layer){like.picture, like.depth};
    layer.picture.width /= 2;
    views_give_layer(views, &layer);
    wait_for_best(request);
    assert_int_equal(made.layers, 1);
}

/* A post before a wall, of colours that tell each texel. */
static struct views_key varied_key(void)
{
    struct views_key key = some_key(0);
    for (int i = 0; i < EDGE * EDGE; i++) {
        const uint8_t texel[] = {(uint8_t)(i % EDGE * 4), (uint8_t)(i / EDGE * 4), is_post(i) ? 255 : 0, 255};
        memcpy(key.picture.pixels + 4 * i, texel, sizeof(texel));
        key.depth[i] = is_post(i) ? 0.5f : 2;
    }
    return key;
}

/* The part of `picture` from this column and row on is what is seen from there. Returns the share that is behind.
 */
static float expect_eye(struct fl_warp *warp, int column, int row, uint32_t width, uint32_t height, float x)
{
    static uint32_t colours[EDGE * EDGE];
    static uint8_t mask[EDGE * EDGE];
    struct fl_warp_error error = {0};
    const struct fl_warp_view view = {
        .width = width, .height = height, .camera = camera_at(x), .quality = FL_WARP_TREE};
    struct fl_warp_picture alone = {.colours = colours, .mask = mask};
    assert_true(fl_warp_make(warp, &view, &alone, &error));
    for (int y = 0; y < (int)height; y++)
        assert_memory_equal(picture.pixels + ((row + y) * EDGE + column) * 4, colours + y * (int)width, 4 * width);
    return alone.counts.behind;
}

TEST(both_eyes_are_those_of_views_half_the_distance_aside)
{
    struct fl_warp_error error = {0};
    struct warped_key alike = {.warp = fl_warp_create(1, &error)};
    struct views_key key = varied_key();
    assert_true(alike.warp && warped_key_set(&alike, &key, &error));
    key = varied_key();
    views_give_key(views, &key);
    for (int over = 0; over < 2; over++) {
        const struct views_request request = {.width = EDGE,
                                              .height = EDGE,
                                              .camera = camera_at(0.01f),
                                              .baseline = 0.1f,
                                              .over = over,
                                              .frame_ns = 1000000};
        const uint64_t number = views_start(views, &request);
        wait_for_best(number);
        const uint32_t width = over ? EDGE : EDGE / 2, height = over ? EDGE / 2 : EDGE;
        const float left = expect_eye(alike.warp, 0, 0, width, height, 0.01f - 0.05f);
        const float right =
            expect_eye(alike.warp, over ? 0 : EDGE / 2, over ? EDGE / 2 : 0, width, height, 0.01f + 0.05f);
        assert_true(left > 0 && right > 0);
        assert_float_equal(made.counts.behind, (left + right) / 2, 1e-6); /* mean of both: rounding alone */
    }
    fl_warp_destroy(alike.warp);
}

TEST(a_final_picture_stays_the_key_until_its_views_have_holes)
{
    struct views_key key = some_key(100);
    views_give_key(views, &key);
    wait_for_best(start(0.01f));
    key = some_key(50);
    key.is_moving = true;
    key.is_final = false;
    views_give_key(views, &key);
    const uint64_t near = start(0.02f);
    wait_for_best(near);
    assert_int_equal(grey(), 100);
    assert_true(views_unseen(&made) > 0 && views_unseen(&made) < 0.03f);
    /* Farther aside more than PLAN_UNSEEN_LITTLE is unseen. */
    wait_for_best(start(0.15f));
    assert_int_equal(grey(), 50);
}

TEST(a_view_has_no_more_pixels_than_its_key_shows)
{
    struct views_key key = some_key(100);
    views_give_key(views, &key);
    wait_for_best(start_of_size(4 * EDGE, 2 * EDGE, 0));
    assert_true(picture.width == 2 * EDGE && picture.height == EDGE);
    wait_for_best(start_of_size(EDGE / 2, EDGE / 2, 0));
    assert_true(picture.width == EDGE / 2 && picture.height == EDGE / 2);
}

TEST(a_view_of_an_earlier_motion_does_not_come_in_a_later_one)
{
    struct views_key key = some_key(100);
    views_give_key(views, &key);
    for (int motion = 0; motion < 20; motion++) {
        start(0.05f);
        poll(NULL, 0, motion % 4); /* the view is made, or not yet */
        views_stop(views);
        assert_false(views_take(views, &picture, &made));
        const uint64_t request = start(-0.05f);
        wait_for_one();
        assert_true(made.request == request);
        views_stop(views);
    }
    views_forget_keys(views);
    start(0);
    poll(NULL, 0, 5);
    assert_false(views_take(views, &picture, &made));
}

TEST(a_picture_of_which_no_view_can_be_made_is_reported_and_the_next_one_helps)
{
    struct fl_warp_error why = {0};
    struct views_key key = some_key(100);
    key.camera.world_from_view[0] = NAN;
    start(0);
    views_give_key(views, &key);
    const uint64_t end_ns = monotonic_now_ns() + PATIENCE_NS;
    while (!views_take_error(views, &why) && monotonic_now_ns() < end_ns)
        poll(NULL, 0, 1);
    assert_int_equal(why.code, FL_WARP_ERROR_ARGUMENT);
    assert_false(views_take_error(views, &why) || views_take(views, &picture, &made));
    key = some_key(100);
    key.depth[0] = NAN; /* nothing is known there */
    views_give_key(views, &key);
    wait_for_one();
    assert_int_equal(grey(), 100);
}

static float fitted_depth(int width, int height, int x, int y)
{
    const int half_width = (width + 1) / 2, half_height = (height + 1) / 2;
    struct views_layer layer = {.depth = malloc(sizeof(float) * (size_t)(half_width * half_height))};
    struct fl_error error;
    assert_true(layer.depth && pixmap_resize(&layer.picture, half_width, half_height, &error));
    memset(layer.picture.pixels, 0, 4 * (size_t)(half_width * half_height));
    for (int i = 0; i < half_width * half_height; i++)
        layer.depth[i] = (float)i;
    assert_true(views_layer_fit(&layer, width, height));
    assert_int_equal(layer.picture.width, width);
    const float depth = layer.depth[y * width + x];
    views_layer_finish(&layer);
    return depth;
}

/* Both axes go through the middle: where the side is odd the outer pixels cover half of one beyond it. */
TEST(a_layer_of_half_the_size_becomes_one_of_the_whole)
{
    const int even[] = {0, 0, 1, 1, 2, 2}, odd[] = {0, 1, 1, 2, 2};
    for (int x = 0; x < 6; x++)
        assert_true(fitted_depth(6, 4, x, 3) == (float)(3 + even[x]));
    for (int x = 0; x < 5; x++)
        assert_true(fitted_depth(5, 3, x, 1) == (float)(3 + odd[x]));
}
