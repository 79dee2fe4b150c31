/* SPDX-License-Identifier: MIT */
/* When views are made here, of which camera the daemon is asked for a picture, and in which quality. */
#include "viewer/view/plan.h"
#include "tests/harness/test.h"

#include <math.h>

#define MS UINT64_C(1000000)
#define SECOND (1000 * MS)
/* Rounding of a few dozen operations on numbers of about ten. */
#define CLOSE 1e-12

static struct viewer_camera some_camera(double x)
{
    return (struct viewer_camera){.eye = {x, 0, 5}, .look_at = {x, 0, 0}, .up = {0, 1, 0}, .fov_y = 0.8};
}

/* ---- whether ---- */

TEST(views_begin_where_a_picture_takes_longer_than_a_frame_and_end_after_a_while_of_fast_ones)
{
    struct plan_switch plan = {0};
    assert_false(plan_switch(&plan, 0.016, 1 * SECOND));
    assert_false(plan.on);
    assert_true(plan_switch(&plan, 0.020, 2 * SECOND));
    assert_true(plan.on);
    /* Nearly a frame is no reason to end. */
    for (uint64_t at = 3; at < 20; at++)
        assert_false(plan_switch(&plan, 0.015, at * SECOND));
    assert_true(plan.on);
    /* Nor is a short time of fast ones, with a slower one in between. */
    assert_false(plan_switch(&plan, 0.005, 20 * SECOND));
    assert_false(plan_switch(&plan, 0.012, 21 * SECOND));
    assert_false(plan_switch(&plan, 0.005, 22 * SECOND));
    assert_false(plan_switch(&plan, 0.005, 23 * SECOND));
    assert_true(plan_switch(&plan, 0.005, 24 * SECOND));
    assert_false(plan.on);
    /* Off, the same time does not begin them again. */
    assert_false(plan_switch(&plan, 0.015, 25 * SECOND));
    assert_false(plan.on);
}

/* ---- of which camera ---- */

TEST(a_steady_flight_is_foreseen)
{
    struct plan_motion motion = {0};
    struct viewer_camera camera = {0};
    for (uint64_t at = 0; at <= 200; at += 4) /* 2 m/s */
        plan_motion_add(&motion,
                        &(struct viewer_camera){.eye = {(double)at * 0.002, 0, 5},
                                                .look_at = {(double)at * 0.002, 0, 0},
                                                .up = {0, 1, 0},
                                                .fov_y = 0.8},
                        SECOND + at * MS);
    plan_motion_predict(&motion, SECOND + 200 * MS, 100 * MS, &camera);
    assert_true(fabs(camera.eye[0] - 0.6) < CLOSE && fabs(camera.look_at[0] - 0.6) < CLOSE);
    assert_true(camera.eye[2] == 5 && camera.fov_y == 0.8);
    /* Nothing is foreseen beyond 0.4 s. */
    plan_motion_predict(&motion, SECOND + 200 * MS, 5 * SECOND, &camera);
    assert_true(fabs(camera.eye[0] - 1.2) < CLOSE);
}

TEST(what_has_stopped_is_foreseen_where_it_is)
{
    struct plan_motion motion = {0};
    struct viewer_camera camera = some_camera(-1);
    plan_motion_predict(&motion, SECOND, 100 * MS, &camera);
    assert_true(camera.eye[0] == -1); /* nothing was added: it stays */
    for (uint64_t at = 0; at <= 100; at += 4) {
        camera = some_camera((double)at);
        plan_motion_add(&motion, &camera, SECOND + at * MS);
    }
    plan_motion_predict(&motion, SECOND + 300 * MS, 100 * MS, &camera);
    assert_true(camera.eye[0] == 100 && camera.look_at[0] == 100);
}

/* After a pause nothing is known of the time before. */
TEST(a_beginning_motion_is_not_exaggerated)
{
    struct plan_motion motion = {0};
    struct viewer_camera camera = some_camera(0);
    plan_motion_add(&motion, &camera, SECOND);
    camera = some_camera(0.1);
    plan_motion_add(&motion, &camera, 9 * SECOND);
    plan_motion_predict(&motion, 9 * SECOND, 100 * MS, &camera);
    assert_true(camera.eye[0] > 0.1 && camera.eye[0] <= 0.2 + CLOSE);
}

/* Turns by a radian a second about `up`, for a tenth of a second; then for 0.2 s more. */
static void turn_steadily(void (*turn)(struct viewer_camera *, double, double), struct viewer_camera *foreseen,
                          struct viewer_camera *true_one)
{
    struct plan_motion motion = {0};
    struct viewer_camera camera = some_camera(0);
    for (uint64_t at = 0; at <= 100; at += 4) {
        plan_motion_add(&motion, &camera, SECOND + at * MS);
        if (at < 100)
            turn(&camera, 0.004, 0.001);
    }
    plan_motion_predict(&motion, SECOND + 100 * MS, 200 * MS, foreseen);
    *true_one = camera;
    turn(true_one, 0.2, 0.05);
}

static void expect_same_camera(const struct viewer_camera *a, const struct viewer_camera *b)
{
    for (int i = 0; i < 3; i++)
        assert_true(fabs(a->eye[i] - b->eye[i]) < CLOSE && fabs(a->look_at[i] - b->look_at[i]) < CLOSE);
}

TEST(a_turn_about_the_eye_and_an_orbit_are_foreseen_where_they_lead)
{
    struct viewer_camera foreseen, true_one;
    turn_steadily(camera_turn, &foreseen, &true_one);
    expect_same_camera(&foreseen, &true_one);
    turn_steadily(camera_orbit, &foreseen, &true_one);
    expect_same_camera(&foreseen, &true_one);
}

TEST(going_nearer_is_foreseen_by_its_factor)
{
    struct plan_motion motion = {0};
    struct viewer_camera camera = some_camera(0);
    for (uint64_t at = 0; at <= 100; at += 4) {
        plan_motion_add(&motion, &camera, SECOND + at * MS);
        if (at < 100)
            camera_dolly(&camera, pow(0.5, 0.04), 0); /* a half in a tenth of a second */
    }
    plan_motion_predict(&motion, SECOND + 100 * MS, 200 * MS, &camera);
    assert_true(fabs(camera_distance(&camera) - 5 * 0.125) < CLOSE);
}

TEST(a_camera_that_would_turn_over_stops_before)
{
    struct plan_motion motion = {0};
    struct viewer_camera camera = some_camera(0);
    for (uint64_t at = 0; at <= 100; at += 4) {
        plan_motion_add(&motion, &camera, SECOND + at * MS);
        camera_orbit(&camera, 0, -0.04);
    }
    plan_motion_predict(&motion, SECOND + 100 * MS, 400 * MS, &camera);
    assert_true(fabs(camera_distance(&camera) - 5) < CLOSE);
    assert_true(camera.eye[1] > 0 && hypot(camera.eye[0], camera.eye[2]) > 0.05);
}

/* ---- how pictures come ---- */

TEST(a_picture_is_asked_for_the_middle_of_the_time_in_which_it_is_used)
{
    struct plan_pace pace = {0};
    assert_int_equal(plan_pace_ahead_ns(&pace) / MS, 100); /* 1.5 frames of 15 a second */
    plan_pace_add(&pace, SECOND - 300 * MS, SECOND);       /* the first one waits for a picture at rest */
    assert_int_equal(plan_pace_ahead_ns(&pace) / MS, 100);
    for (uint64_t at = 1; at <= 2; at++)
        plan_pace_add(&pace, SECOND + at * 50 * MS - 80 * MS, SECOND + at * 50 * MS);
    assert_int_equal(plan_pace_ahead_ns(&pace) / MS, 80 + 25);
    plan_pace_add(&pace, 0, 60 * SECOND); /* another motion, of no camera that is known */
    assert_int_equal(plan_pace_ahead_ns(&pace) / MS, 80 + 25);
}

/* ---- in which quality ---- */

TEST(slow_views_step_down_and_the_tree_is_tried_less_and_less_often)
{
    struct plan_rung rung = {0};
    uint64_t now_ns = 10 * SECOND;
    assert_int_equal(rung.quality, FL_WARP_TREE);
    /* A view in time, and one that is a little late now and then, change nothing. */
    for (int i = 0; i < 100; i++, now_ns += 17 * MS)
        plan_rung(&rung, i % 2 == 0 ? 12 * MS : 40 * MS, PLAN_FRAME_NS, now_ns);
    assert_int_equal(rung.quality, FL_WARP_TREE);
    uint64_t pause_ns = SECOND;
    for (int tries = 0; tries < 8; tries++) {
        plan_rung(&rung, 60 * MS, PLAN_FRAME_NS, now_ns);
        assert_int_equal(rung.quality, FL_WARP_ITERATIVE);
        plan_rung(&rung, 5 * MS, PLAN_FRAME_NS, now_ns + pause_ns - 1);
        assert_int_equal(rung.quality, FL_WARP_ITERATIVE);
        now_ns += pause_ns;
        plan_rung(&rung, 5 * MS, PLAN_FRAME_NS, now_ns);
        assert_int_equal(rung.quality, FL_WARP_TREE);
        now_ns += 60 * MS;
        pause_ns = pause_ns < 16 * SECOND ? pause_ns * 2 : pause_ns;
    }
    /* Once the tree has been in time for a second, it is as at first. */
    for (int i = 0; i < 100; i++, now_ns += 17 * MS)
        plan_rung(&rung, 12 * MS, PLAN_FRAME_NS, now_ns);
    plan_rung(&rung, 60 * MS, PLAN_FRAME_NS, now_ns);
    plan_rung(&rung, 5 * MS, PLAN_FRAME_NS, now_ns + SECOND);
    assert_int_equal(rung.quality, FL_WARP_TREE);
}

TEST(views_that_are_all_a_little_late_step_down)
{
    struct plan_rung rung = {0};
    for (int i = 0; i < 6; i++) /* half a frame late each */
        plan_rung(&rung, 25 * MS, PLAN_FRAME_NS, SECOND + (uint64_t)i * 25 * MS);
    assert_int_equal(rung.quality, FL_WARP_ITERATIVE);
}
