/* SPDX-License-Identifier: MIT */
/* The viewer's camera, what mouse and keys do to it, the way through cameras and clips, and what keys switch. */
#include "viewer/input/controls.h"
#include "viewer/input/settings.h"
#include "viewer/input/tour.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HEIGHT 360.0

/* Rounding of a few dozen operations on numbers of about ten. */
#define CLOSE 1e-12

static struct viewer_camera some_camera(void)
{
    return (struct viewer_camera){.eye = {0, 0, 5}, .look_at = {0, 0, 0}, .up = {0, 1, 0}, .fov_y = 0.8};
}

static void check_place(const double place[3], double x, double y, double z)
{
    if (!(fabs(place[0] - x) < CLOSE && fabs(place[1] - y) < CLOSE && fabs(place[2] - z) < CLOSE))
        fail_msg("(%g, %g, %g) in place of (%g, %g, %g)", place[0], place[1], place[2], x, y, z);
}

TEST(an_orbit_keeps_the_distance_and_a_quarter_turn_looks_along_the_other_axis)
{
    struct viewer_camera camera = some_camera();
    camera_orbit(&camera, M_PI / 2, 0); /* the view turns to the right: from the left */
    check_place(camera.eye, -5, 0, 0);
    check_place(camera.look_at, 0, 0, 0);
    camera_orbit(&camera, 0, -0.5); /* and down: from above */
    assert_true(fabs(camera_distance(&camera) - 5) < CLOSE);
    assert_true(fabs(camera.eye[1] - 5 * sin(0.5)) < CLOSE);
}

TEST(an_orbit_stops_before_the_poles_and_comes_back)
{
    struct viewer_camera camera = some_camera();
    for (int i = 0; i < 100; i++)
        camera_orbit(&camera, 0.1, -0.3);
    assert_true(camera.eye[1] > 4.99 && camera.eye[1] < 5);
    camera_orbit(&camera, 0, -10);
    assert_true(hypot(camera.eye[0], camera.eye[2]) > 0.05); /* 0.02 radians at 5 m: the picture has an upright */
    camera_orbit(&camera, 0, M_PI / 2);
    assert_true(fabs(camera.eye[1]) < 0.2);
    camera_orbit(&camera, 0, 10);
    assert_true(camera.eye[1] < -4.99);
}

TEST(turning_keeps_the_eye_and_looks_where_one_turns_to)
{
    struct viewer_camera camera = some_camera();
    camera_turn(&camera, M_PI / 2, 0);
    check_place(camera.eye, 0, 0, 5);
    check_place(camera.look_at, 5, 0, 5);
    camera_turn(&camera, 0, 0.3);
    assert_true(camera.look_at[1] > 0);
}

TEST(panning_moves_what_is_looked_at_across_the_picture)
{
    struct viewer_camera camera = some_camera();
    double direction[3];
    camera_pan(&camera, 0.25, 0);
    /* The former middle is a quarter of the height to the left of it. */
    camera_ray(&camera, 1, 0.25, 0.5, direction);
    const double share = 5 / -direction[2];
    check_place((const double[3]){camera.eye[0] + direction[0] * share, camera.eye[1], camera.eye[2] - 5}, 0, 0,
                0);
}

TEST(a_ray_goes_through_its_pixel)
{
    const struct viewer_camera camera = some_camera();
    double direction[3];
    camera_ray(&camera, 2, 0.5, 0.5, direction);
    check_place(direction, 0, 0, -1);
    camera_ray(&camera, 2, 1, 0, direction); /* the top right corner */
    assert_true(fabs(direction[1] / -direction[2] - tan(0.4)) < CLOSE);
    assert_true(fabs(direction[0] / -direction[2] - 2 * tan(0.4)) < CLOSE);
}

TEST(flying_goes_along_the_view)
{
    struct viewer_camera camera = some_camera();
    camera_turn(&camera, M_PI / 2, 0);
    camera_fly(&camera, (const double[3]){0, 0, 2});
    check_place(camera.eye, 2, 0, 5);
    camera_fly(&camera, (const double[3]){1, 3, 0});
    check_place(camera.eye, 2, 3, 6);
    assert_true(fabs(camera_distance(&camera) - 5) < CLOSE);
}

TEST(a_dolly_ends_before_what_is_looked_at)
{
    struct viewer_camera camera = some_camera();
    camera_dolly(&camera, 0.5, 1);
    check_place(camera.eye, 0, 0, 2.5);
    camera_dolly(&camera, 0.1, 1);
    check_place(camera.eye, 0, 0, 1);
    camera_dolly(&camera, 3, 1);
    check_place(camera.eye, 0, 0, 3);
}

TEST(focussing_keeps_the_eye_and_leaves_what_cannot_be_looked_at)
{
    struct viewer_camera camera = some_camera();
    camera_focus(&camera, (const double[3]){1, 2, 0});
    check_place(camera.look_at, 1, 2, 0);
    check_place(camera.eye, 0, 0, 5);
    camera_focus(&camera, camera.eye);
    check_place(camera.look_at, 1, 2, 0);
    camera_focus(&camera, (const double[3]){0, 9, 5}); /* straight up */
    check_place(camera.look_at, 1, 2, 0);
}

TEST(a_frames_camera_is_found_again)
{
    struct viewer_camera camera;
    /* Looks along -x from (3, 1, 2). */
    struct fl_frame frame = {.fov_y = 0.5f, .world_from_view = {0, 0, 1, 3, 0, 1, 0, 1, -1, 0, 0, 2}};
    camera_from_frame(&camera, &frame, 4);
    check_place(camera.eye, 3, 1, 2);
    check_place(camera.look_at, -1, 1, 2);
    check_place(camera.up, 0, 1, 0);
    assert_true(camera.fov_y == 0.5);
    /* Rolled by a right angle: its own upright is kept. */
    struct fl_frame rolled = {.fov_y = 0.5f, .world_from_view = {0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0}};
    camera_from_frame(&camera, &rolled, 1);
    check_place(camera.up, 0, 0, 1);
    /* Orthographic, 2 m high: the perspective one sees as much where it looks at. */
    frame.fov_y = 0;
    frame.ortho_height = 2;
    camera_from_frame(&camera, &frame, 4);
    check_place(camera.look_at, -1, 1, 2);
    assert_true(fabs(2 * tan(camera.fov_y / 2) * camera_distance(&camera) - 2) < 1e-6);
}

TEST(a_pose_is_that_of_the_frame_that_the_camera_is_from)
{
    struct viewer_camera camera = some_camera();
    float pose[12], again[12];
    camera_turn(&camera, 0.3, 0.2);
    camera_pose(&camera, pose);
    struct fl_frame frame = {.fov_y = 0.8f};
    memcpy(frame.world_from_view, pose, sizeof(pose));
    camera_from_frame(&camera, &frame, 5);
    camera_pose(&camera, again);
    for (int i = 0; i < 12; i++)
        assert_true(fabsf(pose[i] - again[i]) < 1e-6f); /* single precision once */
    assert_true(pose[3] == 0 && pose[11] == 5);
}

TEST(between_two_cameras_the_ends_are_the_cameras)
{
    const struct viewer_camera from = some_camera();
    struct viewer_camera to = from, camera;
    camera_orbit(&to, M_PI, 0);
    camera_between(&from, &to, 0, &camera);
    check_place(camera.eye, 0, 0, 5);
    camera_between(&from, &to, 1, &camera);
    assert_memory_equal(&camera, &to, sizeof(to));
    camera_between(&from, &to, 0.5, &camera); /* both would be the same place */
    assert_true(camera_distance(&camera) > 1);
    to = from;
    to.eye[0] = 4;
    camera_between(&from, &to, 0.5, &camera);
    check_place(camera.eye, 2, 0, 5);
}

/* ---- mouse and keys ---- */

static bool give(struct controls *controls, struct viewer_camera *camera, struct input input)
{
    return controls_input(controls, &input, HEIGHT, camera);
}

static struct viewer_camera drag(enum input_button button, bool shift, double right, double down)
{
    struct viewer_camera camera = some_camera();
    struct controls controls = {0};
    assert_false(
        give(&controls, &camera, (struct input){.kind = INPUT_MOTION, .x = 9, .y = 9})); /* none is held */
    assert_false(
        give(&controls, &camera,
             (struct input){.kind = INPUT_BUTTON_DOWN, .button = button, .shift = shift, .x = 50, .y = 60}));
    assert_true(give(&controls, &camera, (struct input){.kind = INPUT_MOTION, .x = 50 + right, .y = 60 + down}));
    assert_false(give(&controls, &camera, (struct input){.kind = INPUT_MOTION, .x = 50 + right, .y = 60 + down}));
    give(&controls, &camera, (struct input){.kind = INPUT_BUTTON_UP, .button = button});
    assert_false(give(&controls, &camera, (struct input){.kind = INPUT_MOTION, .x = 500, .y = 600}));
    return camera;
}

TEST(what_is_dragged_follows_the_pointer)
{
    struct viewer_camera camera = drag(INPUT_LEFT, false, 40, 0);
    assert_true(camera.eye[0] < -0.5 && fabs(camera.eye[1]) < CLOSE); /* seen from the left: it turned right */
    camera = drag(INPUT_LEFT, false, 0, 40);
    assert_true(camera.eye[1] > 0.5); /* seen from above: its top came down */
    camera = drag(INPUT_LEFT, true, 36, 0);
    assert_true(camera.look_at[0] < -0.1 && camera.eye[2] == 5);
    const struct viewer_camera same = drag(INPUT_MIDDLE, false, 36, 0);
    assert_memory_equal(&camera, &same, sizeof(same));
    camera = drag(INPUT_RIGHT, false, 40, 0);
    check_place(camera.eye, 0, 0, 5);
    assert_true(camera.look_at[0] > 0.1);
}

TEST(the_wheel_goes_nearer_and_back)
{
    struct viewer_camera camera = some_camera();
    struct controls controls = {0};
    assert_true(give(&controls, &camera, (struct input){.kind = INPUT_WHEEL, .wheel = 3}));
    assert_true(camera_distance(&camera) < 4);
    assert_true(give(&controls, &camera, (struct input){.kind = INPUT_WHEEL, .wheel = -3}));
    assert_true(fabs(camera_distance(&camera) - 5) < 1e-9);
}

TEST(held_keys_fly_until_they_are_let_go_of)
{
    struct viewer_camera camera = some_camera();
    struct controls controls = {0};
    assert_false(controls_fly(&controls, 1, &camera));
    give(&controls, &camera, (struct input){.kind = INPUT_KEY_DOWN, .key = "w"});
    assert_true(controls_fly(&controls, 0.5, &camera));
    const double slow = 5 - camera.eye[2];
    assert_true(slow > 0);
    give(&controls, &camera, (struct input){.kind = INPUT_KEY_DOWN, .key = "s"});
    assert_false(controls_fly(&controls, 0.5, &camera)); /* both ways at once */
    give(&controls, &camera, (struct input){.kind = INPUT_KEY_UP, .key = "s", .shift = true});
    const double before = camera.eye[2];
    assert_true(controls_fly(&controls, 0.5, &camera));
    assert_true(before - camera.eye[2] > 2 * slow);
    give(&controls, &camera, (struct input){.kind = INPUT_FOCUS_LOST});
    assert_false(controls_fly(&controls, 0.5, &camera));
}

TEST(keys_mean_what_the_list_says)
{
    assert_int_equal(input_action(&(struct input){.key = "t"}), ACTION_NEXT_TRACER);
    assert_int_equal(input_action(&(struct input){.key = "t", .shift = true}), ACTION_PREVIOUS_TRACER);
    assert_int_equal(input_action(&(struct input){.key = "w"}), ACTION_NONE);
    assert_int_equal(input_action(&(struct input){.key = "?"}), ACTION_NONE);
    for (size_t i = 0; i < input_binding_count; i++) {
        const struct binding *binding = &input_bindings[i];
        assert_true(!binding->keys || binding->doc);
        for (size_t j = 0; j < i && binding->key; j++)
            if (input_bindings[j].key && strcmp(binding->key, input_bindings[j].key) == 0)
                fail_msg("two lines have the key '%s'", binding->key);
    }
}

/* ---- tour and settings ---- */

TEST(cameras_come_round_and_round)
{
    struct tour tour;
    tour_begin(&tour, 0, 0);
    assert_int_equal(tour_camera(&tour, 1), TOUR_NONE);
    tour_begin(&tour, 3, 0);
    const int expected[] = {0, 1, 2, 0};
    for (int i = 0; i < 4; i++)
        assert_int_equal(tour_camera(&tour, 1), expected[i]);
    assert_int_equal(tour_camera(&tour, -1), 2);
    tour_begin(&tour, 3, 0);
    assert_int_equal(tour_camera(&tour, -1), 2);
}

TEST(a_clip_plays_pauses_and_begins_again_at_its_end)
{
    struct tour tour;
    tour_begin(&tour, 0, 2);
    assert_false(tour_advance(&tour, 1)); /* none is chosen */
    tour_play(&tour);
    assert_int_equal(tour.clip, 0);
    tour_set_duration(&tour, 4);
    assert_true(tour_advance(&tour, 1.5));
    assert_true(tour.time_s == 1.5);
    tour_change_speed(&tour, 1);
    assert_true(tour_advance(&tour, 1.5));
    assert_true(fabs(tour.time_s - 0.5) < CLOSE);
    assert_true(tour_seek(&tour, -1));
    assert_true(fabs(tour.time_s - 3.5) < CLOSE);
    assert_false(tour_advance(&tour, 1)); /* a step pauses */
    tour_play(&tour);
    assert_true(tour_advance(&tour, 0.125));
    for (int i = 0; i < 20; i++)
        tour_change_speed(&tour, -1);
    assert_true(tour.speed == 0.125);
    assert_int_equal(tour_clip(&tour, 1), 1);
    assert_true(tour.playing && tour.time_s == 0);
    assert_int_equal(tour_clip(&tour, 1), TOUR_NONE);
    assert_false(tour.playing);
    assert_int_equal(tour_clip(&tour, -1), 1);
}

/* Text of the panel for a setting of the tracer. */
static const char *panel_says(const struct settings *settings, const char *name)
{
    static char text[40];
    const struct field_desc *setting;
    for (size_t i = 0; (setting = panel_setting(settings->tracer, i)); i++)
        if (strcmp(setting->name, name) == 0)
            panel_value(setting, &settings->tracers, text, sizeof(text));
    return text;
}

static void choose(struct settings *settings, const char *name)
{
    settings->setting = 0;
    while (strcmp(panel_setting(settings->tracer, settings->setting)->name, name) != 0)
        settings_act(settings, ACTION_DOWN);
}

TEST(the_panel_changes_settings_of_every_kind_within_their_ranges)
{
    struct settings settings = {.tracer = PROTOCOL_TRACER_LDC,
                                .tracers = {.ldc.resolution = 1000, .quadtree.pixels = 0.25f}};
    assert_int_equal(settings_act(&settings, ACTION_STEP_ON), SETTINGS_SAME); /* there is no panel yet */
    assert_int_equal(settings_act(&settings, ACTION_PANEL), SETTINGS_DRAWN);
    choose(&settings, "ldc_resolution");
    assert_int_equal(settings_act(&settings, ACTION_STEP_ON), SETTINGS_VIEW);
    assert_string_equal(panel_says(&settings, "ldc_resolution"), "2000");
    for (int i = 0; i < 20; i++)
        settings_act(&settings, ACTION_STEP_ON);
    assert_string_equal(panel_says(&settings, "ldc_resolution"), "4096");
    assert_int_equal(settings_act(&settings, ACTION_STEP_ON), SETTINGS_SAME);
    for (int i = 0; i < 20; i++)
        settings_act(&settings, ACTION_STEP_BACK);
    assert_string_equal(panel_says(&settings, "ldc_resolution"), "16");
    choose(&settings, "ldc_form");
    settings_act(&settings, ACTION_STEP_ON);
    assert_string_equal(panel_says(&settings, "ldc_form"), "paper");
    settings_act(&settings, ACTION_STEP_ON);
    assert_string_equal(panel_says(&settings, "ldc_form"), "fast");
    settings.tracer = PROTOCOL_TRACER_ABUFFER;
    choose(&settings, "abuffer_voxels"); /* auto, 16, 32, 64, 128, 256 */
    settings_act(&settings, ACTION_STEP_BACK);
    assert_string_equal(panel_says(&settings, "abuffer_voxels"), "256");
    settings_act(&settings, ACTION_STEP_ON);
    assert_string_equal(panel_says(&settings, "abuffer_voxels"), "auto");
    settings_act(&settings, ACTION_STEP_ON);
    assert_string_equal(panel_says(&settings, "abuffer_voxels"), "16");
    settings.tracer = PROTOCOL_TRACER_QUADTREE;
    choose(&settings, "quadtree_pixels"); /* 0.001 to 64 */
    settings_act(&settings, ACTION_STEP_ON);
    assert_string_equal(panel_says(&settings, "quadtree_pixels"), "0.5");
    for (int i = 0; i < 30; i++)
        settings_act(&settings, ACTION_STEP_BACK);
    assert_string_equal(panel_says(&settings, "quadtree_pixels"), "0.001");
    assert_int_equal(settings_act(&settings, ACTION_STEP_BACK), SETTINGS_SAME);
    choose(&settings, "quadtree_margin"); /* 0: its default, 0.05 */
    assert_string_equal(panel_says(&settings, "quadtree_margin"), "0.05");
    settings_act(&settings, ACTION_STEP_BACK);
    assert_string_equal(panel_says(&settings, "quadtree_margin"), "0.025");
    settings_act(&settings, ACTION_STEP_ON);
    assert_string_equal(panel_says(&settings, "quadtree_margin"), "0.05");
    settings.tracer = PROTOCOL_TRACER_REFERENCE; /* which has none */
    assert_int_equal(settings_act(&settings, ACTION_DOWN), SETTINGS_SAME);
    assert_int_equal(settings_act(&settings, ACTION_STEP_ON), SETTINGS_SAME);
}

TEST(keys_switch_and_come_back)
{
    struct settings settings = {.tracer = PROTOCOL_TRACER_BVH};
    unsigned steps = 0;
    do {
        assert_int_equal(settings_act(&settings, ACTION_NEXT_TRACER), SETTINGS_VIEW);
        assert_int_not_equal(settings.tracer, PROTOCOL_TRACER_NAIVE);
        steps++;
    } while (settings.tracer != PROTOCOL_TRACER_BVH && steps < 100);
    assert_int_equal(steps, PROTOCOL_TRACER_COUNT - 1);
    settings_act(&settings, ACTION_PREVIOUS_INTEGRATOR);
    assert_int_equal(settings.integrator, PROTOCOL_INTEGRATOR_COUNT - 1);
    settings_act(&settings, ACTION_NEXT_INTEGRATOR);
    assert_int_equal(settings.integrator, 0);
    assert_int_equal(settings_act(&settings, ACTION_FINER), SETTINGS_SAME);
    assert_int_equal(settings_act(&settings, ACTION_COARSER), SETTINGS_VIEW);
    for (int i = 0; i < 200; i++)
        settings_act(&settings, ACTION_BRIGHTER);
    assert_in_range(settings.exposure_thirds, 3, 3 * 60); /* the protocol has 64 stops */
    assert_int_equal(settings_act(&settings, ACTION_ERROR_MAP), SETTINGS_DRAWN);
    assert_true(settings.error_map);
    for (int i = 0; i < LOCAL_VIEWS_COUNT; i++) {
        assert_int_equal(settings.local, i);
        assert_int_equal(settings_act(&settings, ACTION_LOCAL), SETTINGS_DRAWN);
    }
    assert_int_equal(settings.local, LOCAL_OFF);
    settings_act(&settings, ACTION_HOLES);
    assert_int_equal(settings.holes, FL_WARP_PATTERN);
    settings_act(&settings, ACTION_HOLES);
    assert_int_equal(settings.holes, FL_WARP_FILL);
    assert_int_equal(settings_act(&settings, ACTION_PLAY), SETTINGS_SAME);
}
