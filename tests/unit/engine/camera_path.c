/* SPDX-License-Identifier: MIT */
/* The camera of a frame, against what geometry says about it. */
#include "engine/shot.h"
#include "tests/harness/test.h"
#include "tests/fixtures/framing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979

static void expect_near(const char *what, const float *got, const double *expected, int count, double tolerance)
{
    for (int i = 0; i < count; i++) {
        if (!(fabs((double)got[i] - expected[i]) <= tolerance))
            fail_msg("%s, number %d: %.9g, expected %.9g", what, i, (double)got[i], expected[i]);
    }
}

static void eye_of(const struct frame_camera *camera, float eye[3])
{
    for (int i = 0; i < 3; i++)
        eye[i] = camera->world_from_view[4 * i + 3];
}

/* Columns of unit length, at right angles, right-handed. */
static void expect_rigid(const struct frame_camera *camera)
{
    const float *m = camera->world_from_view;
    for (int a = 0; a < 3; a++) {
        int b = (a + 1) % 3, c = (a + 2) % 3;
        float along = 0, across = 0, cross[3];
        for (int i = 0; i < 3; i++) {
            along += m[4 * i + a] * m[4 * i + a];
            across += m[4 * i + a] * m[4 * i + b];
            int next = (i + 1) % 3, after = (i + 2) % 3;
            cross[i] = m[4 * next + a] * m[4 * after + b] - m[4 * after + a] * m[4 * next + b];
        }
        double column[3] = {(double)m[c], (double)m[4 + c], (double)m[8 + c]};
        expect_near("length", &along, (double[]){1}, 1, 1e-5);
        expect_near("angle", &across, (double[]){0}, 1, 1e-5);
        expect_near("handedness", cross, column, 3, 1e-5);
    }
}

static struct scene *scene; /* empty at first */

static int begin(void **state)
{
    (void)state;
    scene = scene_create("test", NULL);
    return scene ? 0 : -1;
}

static int end(void **state)
{
    (void)state;
    scene_destroy(scene);
    return 0;
}

EACH_TEST(begin, end)

static struct engine_job job_of(enum camera_path path, struct record_camera_key *keys, uint32_t key_count)
{
    return (struct engine_job){
        .last_frame = 1000,
        .frame_step = 1,
        .frames_per_second = 10,
        .frame = {.picture.width = 160, .picture.height = 90},
        .camera = {.camera_path = path, USUAL_FRAMING},
        .keys = keys,
        .key_count = key_count,
    };
}

/* Without clips. */
static bool make_camera(const struct engine_job *job, uint32_t frame, struct frame_camera *camera,
                        struct error *error)
{
    struct shot shot;
    if (!shot_make(&shot, job, scene, frame, NULL, error))
        return false;
    *camera = shot.request.camera;
    shot_finish(&shot);
    return true;
}

static struct frame_camera camera_at(const struct engine_job *job, uint32_t frame)
{
    struct frame_camera camera;
    struct error error = {0};
    if (!make_camera(job, frame, &camera, &error))
        fail_msg("%s: %s", error.field, error.text);
    expect_rigid(&camera);
    return camera;
}

static struct record_camera_key key_at(float time_s, float x, float y, float z)
{
    return (struct record_camera_key){
        .time_s = time_s,
        .eye_world = {x, y, z},
        .look_at_world = {x, y, z - 1},
        .up_world = {0, 1, 0},
        .fov_y = 0.5f + time_s / 10,
    };
}

/* ---- time and keys ------------------------------------------------------------------------------ */

TEST(the_time_of_a_frame_counts_from_the_origin)
{
    struct engine_job job = job_of(CAMERA_AUTO, NULL, 0);
    job.frames_per_second = 24;
    job.time_origin_frame = 100;
    assert_true(animation_time_s(&job, 100) == 0.0);
    assert_true(animation_time_s(&job, 124) == 1.0);
    assert_true(animation_time_s(&job, 52) == -2.0);
    job.time_origin_frame = 0;
    assert_true(fabs(animation_time_s(&job, 10000000) - 10000000 / 24.0) < 1e-9);
}

TEST(one_key_stands_still)
{
    struct record_camera_key key = key_at(3, 1, 2, 3);
    struct engine_job job = job_of(CAMERA_KEYS, &key, 1);
    for (uint32_t frame = 0; frame < 100; frame += 33) {
        struct frame_camera camera = camera_at(&job, frame);
        float eye[3];
        eye_of(&camera, eye);
        expect_near("eye", eye, (double[]){1, 2, 3}, 3, 0);
        expect_near("fov", &camera.fov_y, (double[]){(double)key.fov_y}, 1, 0);
        assert_true(camera.near == 0.0f);
    }
}

TEST(keys_pass_through_their_points_and_stand_still_outside)
{
    struct record_camera_key keys[] = {key_at(1, 0, 0, 0), key_at(2, 5, 1, 0), key_at(4, 6, -3, 2),
                                       key_at(5, 0, 0, 9)};
    struct engine_job job = job_of(CAMERA_KEYS, keys, 4);
    const uint32_t frames[] = {0, 10, 20, 40, 50, 500}; /* 10 a second */
    const int expected[] = {0, 0, 1, 2, 3, 3};
    for (int i = 0; i < 6; i++) {
        struct frame_camera camera = camera_at(&job, frames[i]);
        float eye[3];
        double point[3];
        eye_of(&camera, eye);
        for (int k = 0; k < 3; k++)
            point[k] = (double)keys[expected[i]].eye_world[k];
        expect_near("eye", eye, point, 3, 1e-5);
        expect_near("fov", &camera.fov_y, (double[]){(double)keys[expected[i]].fov_y}, 1, 1e-6);
    }
}

TEST(keys_at_equal_distances_make_the_spline_of_catmull_and_rom)
{
    const float p[] = {1, 4, 2, 7, 7};
    struct record_camera_key keys[5];
    for (int i = 0; i < 5; i++)
        keys[i] = key_at((float)i * 2, p[i], 0, 0);
    for (int segment = 1; segment < 3; segment++) {
        for (double t = 0; t < 1; t += 0.125) {
            double a = (double)p[segment - 1], b = (double)p[segment], c = (double)p[segment + 1],
                   d = (double)p[segment + 2];
            double expected = 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t * t +
                                     (3 * b - a - 3 * c + d) * t * t * t);
            struct record_camera_key key;
            animation_key_at(keys, 5, 2 * (segment + t), &key);
            expect_near("eye", key.eye_world, (double[]){expected, 0, 0}, 3, 1e-5);
            expect_near("look_at", key.look_at_world, (double[]){expected, 0, -1}, 3, 1e-5);
        }
    }
}

TEST(a_line_with_even_speed_stays_one_at_uneven_keys)
{
    const float times[] = {0, 0.5f, 3, 3.25f, 7};
    struct record_camera_key keys[5];
    for (int i = 0; i < 5; i++)
        keys[i] = key_at(times[i], 2 * times[i] + 1, -times[i], 4);
    for (double time_s = 0; time_s <= 7; time_s += 0.0625) {
        struct record_camera_key key;
        animation_key_at(keys, 5, time_s, &key);
        expect_near("eye", key.eye_world, (double[]){2 * time_s + 1, -time_s, 4}, 3, 1e-5);
    }
}

TEST(a_spline_does_not_leave_the_range_of_fields_of_view)
{
    struct record_camera_key keys[] = {key_at(0, 0, 0, 0), key_at(1, 0, 0, 0), key_at(2, 0, 0, 0),
                                       key_at(3, 0, 0, 0)};
    keys[0].fov_y = keys[3].fov_y = 0.001f;
    keys[1].fov_y = keys[2].fov_y = 3.1f;
    for (double time_s = 0; time_s <= 3; time_s += 0.01) {
        struct record_camera_key key;
        animation_key_at(keys, 4, time_s, &key);
        assert_true(key.fov_y >= 0.001f && key.fov_y <= 3.1f);
    }
}

TEST(keys_that_span_no_view_are_errors)
{
    struct record_camera_key keys[] = {key_at(1, 0, 0, 0), key_at(1, 5, 1, 0)};
    struct engine_job job = job_of(CAMERA_KEYS, keys, 2);
    struct error error = {0};
    assert_false(shot_check(&job, scene, NULL, &error));
    assert_string_equal(error.field, "render.keys[1].time_s");
    memcpy(keys[0].look_at_world, keys[0].eye_world, sizeof(keys[0].eye_world));
    job.key_count = 1;
    error = (struct error){0};
    assert_false(shot_check(&job, scene, NULL, &error));
    assert_string_equal(error.field, "render.keys");
    keys[0] = key_at(0, 0, 0, 0);
    keys[0].up_world[1] = 0;
    keys[0].up_world[2] = 1;
    error = (struct error){0};
    assert_false(shot_check(&job, scene, NULL, &error));
    assert_string_equal(error.field, "render.keys");
}

/* ---- orbit -------------------------------------------------------------------------------------- */

TEST(an_orbit_by_90_degrees_is_a_quarter_of_the_circle)
{
    struct record_camera_key key = {
        .eye_world = {10, 3, 5}, .look_at_world = {10, 1, 1}, .up_world = {0, 2, 0}, .fov_y = 0.7f};
    struct engine_job job = job_of(CAMERA_ORBIT, &key, 1);
    job.camera.orbit_turn = (float)(2 * PI);
    job.camera.orbit_seconds = 4;
    /* The eye is at (0, 2, 4) from the centre; a turn about +y takes +z to +x. */
    const double eyes[5][3] = {{10, 3, 5}, {14, 3, 1}, {10, 3, -3}, {6, 3, 1}, {10, 3, 5}};
    for (uint32_t quarter = 0; quarter < 5; quarter++) {
        struct frame_camera camera = camera_at(&job, quarter * 10);
        float eye[3];
        eye_of(&camera, eye);
        expect_near("eye", eye, eyes[quarter], 3, 1e-5);
        /* The camera still looks at the centre, and up is unchanged. */
        double back[3], length = 0;
        for (int i = 0; i < 3; i++) {
            back[i] = eyes[quarter][i] - (double)key.look_at_world[i];
            length += back[i] * back[i];
        }
        for (int i = 0; i < 3; i++)
            back[i] /= sqrt(length);
        const float *m = camera.world_from_view;
        expect_near("back", (float[]){m[2], m[6], m[10]}, back, 3, 1e-5);
        assert_true(m[5] > 0);
        assert_true(fabsf(m[4]) < 1e-5f); /* the horizon is level */
        expect_near("fov", &camera.fov_y, (double[]){0.7}, 1, 1e-6);
    }
}

TEST(an_orbit_turns_about_its_own_up_axis)
{
    struct record_camera_key key = {
        .eye_world = {3, 0, 1}, .look_at_world = {0, 0, 1}, .up_world = {0, 0, 1}, .fov_y = 1};
    struct engine_job job = job_of(CAMERA_ORBIT, &key, 1);
    job.camera.orbit_turn = (float)(PI / 2);
    job.camera.orbit_seconds = 1;
    struct frame_camera camera = camera_at(&job, 10);
    float eye[3];
    eye_of(&camera, eye);
    expect_near("eye", eye, (double[]){0, 3, 1}, 3, 1e-5);
    job.camera.orbit_seconds = 0;
    struct error error = {0};
    assert_false(shot_check(&job, scene, NULL, &error));
    assert_string_equal(error.field, "render.orbit_seconds");
}

TEST(an_orbit_without_a_key_turns_about_the_middle_of_the_scene)
{
    struct scene_edit disc = {.kind = EDIT_SET, .object = OBJECT_DISC};
    disc.set.disc.base.id = 1;
    disc.set.disc.value.centre_world[0] = 100;
    disc.set.disc.value.normal_world[1] = 1;
    disc.set.disc.value.radius = 2;
    struct error error = {0};
    assert_true(scene_commit(scene, &disc, 1, &error));
    struct engine_job job = job_of(CAMERA_ORBIT, NULL, 0);
    job.camera.orbit_turn = 1;
    job.camera.orbit_seconds = 1;
    struct frame_camera first = camera_at(&job, 0), camera;
    float start[3], eye[3];
    eye_of(&first, start);
    for (uint32_t frame = 5; frame < 50; frame += 5) {
        camera = camera_at(&job, frame);
        eye_of(&camera, eye);
        assert_true(fabsf(eye[1] - start[1]) < 1e-4f);
        double angle =
            atan2((double)eye[0] - 100, (double)eye[2]) - atan2((double)start[0] - 100, (double)start[2]);
        double expected = frame / 10.0;
        assert_true(fabs(remainder(angle - expected, 2 * PI)) < 1e-4);
    }
}

/* Distance of the rim of a disc about (x, 0, 0) from the picture's middle, as a share of half the picture. */
static double reach_of(const struct frame_camera *camera, double x, double radius, double aspect)
{
    const float *m = camera->world_from_view;
    const double slope = tan((double)camera->fov_y / 2);
    double reach = 0;
    for (int k = 0; k < 360; k++) {
        const double place[3] = {x + radius * cos(k * PI / 180), 0, radius * sin(k * PI / 180)};
        double view[3] = {0};
        for (int axis = 0; axis < 3; axis++)
            for (int row = 0; row < 3; row++)
                view[axis] += (double)m[4 * row + axis] * (place[row] - (double)m[4 * row + 3]);
        reach = fmax(reach, fmax(fabs(view[0]) / aspect, fabs(view[1])) / -view[2] / slope);
    }
    return reach;
}

TEST(what_an_orbit_goes_around_is_as_large_as_its_margin_allows)
{
    struct scene_edit disc = {.kind = EDIT_SET, .object = OBJECT_DISC};
    disc.set.disc.base.id = 1;
    disc.set.disc.value.centre_world[0] = 3;
    disc.set.disc.value.normal_world[1] = 1;
    disc.set.disc.value.radius = 2;
    struct error error = {0};
    assert_true(scene_commit(scene, &disc, 1, &error));
    struct engine_job job = job_of(CAMERA_ORBIT, NULL, 0);
    job.camera.orbit_turn = job.camera.orbit_seconds = 1;
    job.camera.auto_fov = 12.0f; /* so that the eye is not as near as it may be */
    const double aspect = (double)job.frame.picture.width / job.frame.picture.height,
                 wanted = 1 - 2 * (double)job.camera.auto_margin;
    for (uint32_t frame = 0; frame < 60; frame += 7) {
        const struct frame_camera camera = camera_at(&job, frame);
        /* A disc is all of its poses: it touches the margin in each. */
        assert_true(fabs(reach_of(&camera, 3, 2, aspect) - wanted) < 0.01);
    }
}

TEST(an_empty_scene_has_an_automatic_camera_too)
{
    struct engine_job job = job_of(CAMERA_AUTO, NULL, 0);
    struct frame_camera camera = camera_at(&job, 0);
    for (int i = 0; i < 12; i++)
        assert_true(isfinite(camera.world_from_view[i]));
}

/* ---- a camera of the scene ---------------------------------------------------------------------- */

TEST(a_camera_node_gives_its_place_without_its_scale_or_mirror)
{
    /* Turned by 90 degrees about y, mirrored in x, scaled by 2, 3 and 4. */
    const float parent[12] = {0, 0, 4, 1, 0, 3, 0, 2, 2, 0, 0, 3},
                child[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 5};
    struct scene_edit edits[] = {
        {.kind = EDIT_SET, .object = OBJECT_CAMERA},
        {.kind = EDIT_SET, .object = OBJECT_NODE},
        {.kind = EDIT_SET, .object = OBJECT_NODE},
    };
    edits[0].set.camera = (struct scene_camera){.base.id = 4, .value.fov_y = 0.9f, .value.near = 0.25f};
    edits[1].set.node = (struct scene_node){.base.id = 1};
    edits[2].set.node =
        (struct scene_node){.base.id = 2, .value.parent = 1, .value.kind = NODE_CAMERA, .value.object = 4};
    memcpy(edits[1].set.node.value.parent_from_node, parent, sizeof(parent));
    memcpy(edits[2].set.node.value.parent_from_node, child, sizeof(child));
    struct error error = {0};
    if (!scene_commit(scene, edits, 3, &error))
        fail_msg("%s", error.text);
    struct engine_job job = job_of(CAMERA_NODE, NULL, 0);
    job.camera.camera_node = 2;
    struct frame_camera camera = camera_at(&job, 0);
    const float *m = camera.world_from_view;
    expect_near("eye", (float[]){m[3], m[7], m[11]}, (double[]){21, 2, 3}, 3, 1e-5);
    expect_near("back", (float[]){m[2], m[6], m[10]}, (double[]){1, 0, 0}, 3, 1e-6);
    expect_near("up", (float[]){m[1], m[5], m[9]}, (double[]){0, 1, 0}, 3, 1e-6);
    assert_true(camera.fov_y == 0.9f && camera.near == 0.25f);
    job.camera.camera_node = 1;
    assert_false(shot_check(&job, scene, NULL, &error));
    assert_int_equal(error.kind, ERROR_INVALID);
    assert_string_equal(error.field, "render.camera_node");
}

/* A frame tells its camera and its time to the client, in fields that have bounds. */
TEST(what_a_frame_could_not_tell_is_an_error_before_it_is_rendered)
{
    struct frame_camera camera;
    struct error error = {0};
    struct engine_job job = job_of(CAMERA_AUTO, NULL, 0);
    job.frames_per_second = 0.001f;
    assert_true(make_camera(&job, 900000, &camera, &error));
    assert_false(make_camera(&job, 10000000, &camera, &error));
    assert_int_equal(error.kind, ERROR_INVALID);
    assert_string_equal(error.field, "render.frames_per_second");

    error = (struct error){0};
    struct record_camera_key keys[] = {key_at(0, 0, 0, 0), key_at(1, 1e12f, 0, 0), key_at(2, 1e12f, 0, 0),
                                       key_at(3, 0, 0, 0)};
    for (int i = 0; i < 4; i++)
        keys[i].look_at_world[2] = -1e12f;
    job = job_of(CAMERA_KEYS, keys, 4);
    assert_true(make_camera(&job, 10, &camera, &error));
    assert_false(make_camera(&job, 15, &camera, &error)); /* the spline goes beyond its keys */
    assert_int_equal(error.kind, ERROR_INVALID);
    assert_string_equal(error.field, "render.camera_path");
    assert_string_not_equal(error.remedy, "");
}
