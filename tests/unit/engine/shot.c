/* SPDX-License-Identifier: MIT */
/* Frames of a job that plays clips: poses over the shutter, cameras, lenses, noise. */
#include "tests/unit/engine/engine_fake.h"
#include "tests/unit/scene/drafts.h"

#include "engine/shot.h"
#include "tests/harness/test.h"
#include "tests/fixtures/framing.h"

#include <math.h>

#define PI 3.14159265358979323846

/* Node 1 turns about z by `degrees` in the second of clip 1; below it hangs node 2, which turns by as much again
 * in clip 2; it shows mesh 1, that nothing deforms. Node 3 shows a camera and moves along x with clip 1. */
static void add_turning(struct draft_list *list, double degrees)
{
    add_mesh(list, 1);
    add_set(list, OBJECT_CAMERA, 1)->set.camera.value.fov_y = 1;
    add_node(list, 1, 0);
    add_shown(list, 2, NODE_MESH, 1)->value.parent = 1;
    add_shown(list, 3, NODE_CAMERA, 1);
    /* Keys close enough for the arc between two of them to be the shorter one. */
    enum { KEYS = 65 };
    static float numbers[KEYS * 5 + 6];
    for (int i = 0; i < KEYS; i++) {
        double half = degrees * PI / 360 * i / (KEYS - 1);
        numbers[i] = (float)i / (KEYS - 1);
        memcpy(numbers + KEYS + 4 * i, (float[]){0, 0, (float)sin(half), (float)cos(half)}, 16);
    }
    memcpy(numbers + KEYS * 5, (float[]){0, 0, 0, 100, 0, 0}, 24);
    add_clip(list, 1, numbers, KEYS * 5 + 6);
    add_clip(list, 2, numbers, KEYS * 5 + 6);
    add_channel(list, 1, 1, CHANNEL_NODE_ROTATION, 1, 4, KEYS);
    add_channel(list, 2, 2, CHANNEL_NODE_ROTATION, 2, 4, KEYS);
    struct scene_channel *moving = add_channel(list, 3, 1, CHANNEL_NODE_TRANSLATION, 3, 3, 2);
    moving->value.first_time = 0;
    moving->value.first_value = KEYS * 5;
    moving->value.key_count = 2;
}

static struct scene *turning_scene(double degrees)
{
    struct scene *scene = new_scene();
    struct draft_list list = {0};
    add_turning(&list, degrees);
    expect_commit(scene, &list);
    return scene;
}

static uint32_t pose_count(const struct scene *scene, uint32_t clip_count, double open_s, double shutter_s)
{
    const struct record_clip_use uses[] = {{.clip = 1, .speed = 1}, {.clip = 2, .speed = 1}};
    struct scene_motion motion;
    struct error error = {0};
    if (!scene_motion_evaluate(&motion, scene, uses, clip_count, open_s, shutter_s, &error))
        fail_msg("%s: %s", error.field, error.text);
    uint32_t count = motion.pose_count;
    for (uint32_t i = 0; i < count; i++) {
        struct scene_pose alone;
        double time_s = count > 1 ? open_s + shutter_s * i / (count - 1) : open_s;
        assert_true(scene_pose_evaluate(&alone, scene, uses, clip_count, time_s, NULL));
        assert_int_equal(alone.node_count, motion.poses[i].node_count);
        for (uint32_t node = 0; node < alone.node_count; node++)
            assert_memory_equal(alone.nodes[node].parent_from_node, motion.poses[i].nodes[node].parent_from_node,
                                48);
        scene_pose_finish(&alone);
    }
    scene_motion_finish(&motion);
    return count;
}

TEST(there_are_as_many_poses_as_the_fastest_turn_needs)
{
    const struct {
        double degrees;
        uint32_t alone, together;
    } cases[] = {{4, 2, 2},  {9, 2, 3},  {11, 3, 5},  {19, 3, 5},  {21, 5, 9},
                 {39, 5, 9}, {41, 9, 9}, {360, 9, 9}, {1440, 9, 9}};
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct scene *scene = turning_scene(cases[i].degrees);
        uint32_t alone = pose_count(scene, 1, 0, 1), together = pose_count(scene, 2, 0, 1);
        if (alone != cases[i].alone || together != cases[i].together)
            fail_msg("%g degrees: %u poses, %u where what hangs below turns too; expected %u and %u",
                     cases[i].degrees, alone, together, cases[i].alone, cases[i].together);
        assert_int_equal(pose_count(scene, 2, 0, 0), 1);
        assert_int_equal(pose_count(scene, 2, 1, 1), 1); /* the clip has come to its end */
        assert_int_equal(pose_count(scene, 2, 0, 1 / 1024.0), 2);
        scene_destroy(scene);
    }
}

TEST(joints_alone_need_two_poses)
{
    struct scene *scene = turning_scene(90);
    struct draft_list list = {0};
    const uint16_t joints[8] = {0};
    const float weights[8] = {1, 0, 1, 0, 1, 0, 1, 0};
    add_joints(add_mesh(&list, 1), joints, weights);
    add_skin(&list, 1, (uint32_t[]){1}, 1);
    struct scene_node *node = add_shown(&list, 2, NODE_MESH, 1);
    node->value.skin = 1;
    node->value.parent = 1;
    expect_commit(scene, &list);
    assert_int_equal(pose_count(scene, 2, 0, 1), 2);
    scene_destroy(scene);
}

/* ---- cameras and lenses -------------------------------------------------------------------------- */

static struct record_camera_key home = {
    .eye_world = {0, 0, 5}, .look_at_world = {0, 0, 0}, .up_world = {0, 1, 0}, .fov_y = 0.5f};

static struct engine_job job_of(enum camera_path path, struct record_clip_use *clips, uint32_t clip_count)
{
    bool has_key = path == CAMERA_KEYS || path == CAMERA_ORBIT;
    return (struct engine_job){
        .last_frame = 1000,
        .frame_step = 1,
        .frames_per_second = 10,
        .frame = {.picture.width = 160, .picture.height = 90, .sampling.samples = 1, .sampling.seed = 77},
        .camera = {.camera_path = path, .camera_node = 3, USUAL_FRAMING},
        .keys = has_key ? &home : NULL,
        .key_count = has_key,
        .clips = clips,
        .clip_count = clip_count,
    };
}

static struct shot shot_at(const struct engine_job *job, const struct scene *scene, uint32_t frame)
{
    struct shot shot;
    struct error error = {0};
    if (!shot_make(&shot, job, scene, frame, NULL, &error))
        fail_msg("%s: %s", error.field, error.text);
    return shot;
}

static void expect_refused(const struct engine_job *job, const struct scene *scene, enum error_code kind,
                           const char *field)
{
    struct error error = {0};
    assert_false(shot_check(job, scene, NULL, &error));
    assert_string_equal(error.field, field);
    assert_int_equal(error.kind, kind);
}

TEST(a_camera_at_a_node_moves_with_it)
{
    struct scene *scene = turning_scene(90);
    struct record_clip_use use = {.clip = 1, .speed = 1};
    struct engine_job job = job_of(CAMERA_NODE, &use, 1);
    job.time_origin_frame = 10;
    for (uint32_t frame = 10; frame <= 15; frame++) {
        struct shot shot = shot_at(&job, scene, frame);
        /* 100 m from its first key to its last, the 64th part of a second behind. */
        float x = shot.request.camera.world_from_view[3];
        float expected = fminf(100.0f * 64 * (float)(frame - 10) / 10, 100);
        assert_true(fabsf(x - expected) < 1e-3f);
        assert_false(shot.request.has_neighbours || shot.motion.has_neighbours);
        shot_finish(&shot);
    }
    scene_destroy(scene);
}

/* A frame of the rate away, whatever the step, and where that is before the first or behind the last one, too. */
TEST(motion_vectors_have_the_cameras_and_poses_of_the_frames_beside)
{
    struct scene *scene = turning_scene(90);
    struct record_clip_use use = {.clip = 1, .speed = 1, .start_s = -0.05f};
    struct engine_job job = job_of(CAMERA_NODE, &use, 1);
    job.frames_per_second = 100;
    job.first_frame = job.last_frame = 5;
    job.frame_step = 3;
    job.frame.picture.layers = 1u << LAYER_MOTION;
    struct shot shot = shot_at(&job, scene, 0), before, after;
    job.time_origin_frame = 1;
    before = shot_at(&job, scene, 0);
    job.time_origin_frame = 0;
    after = shot_at(&job, scene, 1);
    assert_true(shot.request.has_neighbours && shot.motion.has_neighbours);
    assert_memory_equal(&shot.request.camera_earlier, &before.request.camera, sizeof(before.request.camera));
    assert_memory_equal(&shot.request.camera_later, &after.request.camera, sizeof(after.request.camera));
    assert_memory_equal(shot.motion.earlier.nodes, before.motion.poses[0].nodes,
                        sizeof(*before.motion.poses[0].nodes));
    assert_memory_equal(shot.motion.later.nodes, after.motion.poses[0].nodes,
                        sizeof(*after.motion.poses[0].nodes));
    assert_true(memcmp(before.motion.poses[0].nodes, after.motion.poses[0].nodes, sizeof(struct pose_node)) != 0);
    shot_finish(&shot);
    shot_finish(&before);
    shot_finish(&after);
    job = job_of(CAMERA_KEYS, NULL, 0); /* nothing plays, and the camera has one key */
    job.frame.picture.layers = 1u << LAYER_MOTION;
    shot = shot_at(&job, scene, 0);
    assert_memory_equal(&shot.request.camera_later, &shot.request.camera, sizeof(shot.request.camera));
    assert_false(shot.motion.has_neighbours);
    shot_finish(&shot);
    scene_destroy(scene);
}

/* ---- frames between those that are rendered ------------------------------------------------------ */

TEST(the_key_of_a_frame_is_the_nearest_one_and_of_two_the_earlier)
{
    const struct {
        uint32_t upsample, origin, frame, key;
    } cases[] = {{0, 0, 7, 7}, {1, 0, 7, 7},    {4, 0, 0, 0},   {4, 0, 1, 0},  {4, 0, 2, 0},
                 {4, 0, 3, 4}, {4, 0, 4, 4},    {4, 1, 4, 5},   {4, 1, 3, 1},  {3, 0, 1, 0},
                 {3, 0, 2, 3}, {2, 0, 5, 4},    {4, 10, 9, 10}, {4, 10, 8, 6}, {4, 10, 0, 2},
                 {4, 3, 0, 3}, {64, 0, 33, 64}, {64, 0, 32, 0}, {4, 7, 11, 11}};
    struct engine_job job = job_of(CAMERA_KEYS, NULL, 0);
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        job.frame.picture.upsample = cases[i].upsample;
        job.time_origin_frame = cases[i].origin;
        assert_int_equal(shot_key_frame(&job, cases[i].frame), cases[i].key);
        job.first_frame = cases[i].frame; /* a range that begins there has the same key */
        assert_int_equal(shot_key_frame(&job, cases[i].frame), cases[i].key);
        job.first_frame = 0;
    }
}

TEST(a_frame_that_is_made_from_its_key_has_a_camera_of_its_own_and_the_rest_of_the_key)
{
    struct scene *scene = turning_scene(90);
    struct record_clip_use use = {.clip = 1, .speed = 1};
    struct engine_job job = job_of(CAMERA_NODE, &use, 1);
    job.frames_per_second = 1000;
    job.frame.picture.view_source = VIEW_SOURCE_LAYERS;
    struct shot key = shot_at(&job, scene, 4), own = shot_at(&job, scene, 6);
    assert_false(own.request.has_key);
    job.frame.picture.upsample = 4;
    struct shot made = shot_at(&job, scene, 6), rendered = shot_at(&job, scene, 4);
    assert_true(made.request.has_key && made.request.picture.view_source == VIEW_SOURCE_LAYERS);
    assert_memory_equal(made.request.camera.world_from_view, own.request.camera.world_from_view, 48);
    assert_memory_equal(made.request.key_camera.world_from_view, key.request.camera.world_from_view, 48);
    assert_true(made.request.camera.world_from_view[3] > made.request.key_camera.world_from_view[3]);
    assert_true(made.time_s == own.time_s && made.request.sampling.seed == key.request.sampling.seed);
    assert_memory_equal(made.motion.poses[0].nodes[0].parent_from_node,
                        key.motion.poses[0].nodes[0].parent_from_node, 48);
    /* The key itself is made from the layers that the others need anyway. */
    assert_true(rendered.request.has_key && rendered.request.picture.view_source == VIEW_SOURCE_LAYERS);
    assert_memory_equal(rendered.request.key_camera.world_from_view, key.request.camera.world_from_view, 48);
    assert_memory_equal(rendered.request.camera.world_from_view, key.request.camera.world_from_view, 48);
    shot_finish(&key);
    shot_finish(&own);
    shot_finish(&made);
    shot_finish(&rendered);
    scene_destroy(scene);
}

TEST(layers_are_asked_for_where_a_picture_needs_them)
{
    struct scene *scene = turning_scene(90);
    struct engine_job job = job_of(CAMERA_KEYS, NULL, 0);
    job.frame.picture.view_source = VIEW_SOURCE_LAYERS;
    struct shot shot = shot_at(&job, scene, 0);
    assert_int_equal(shot.request.picture.view_source, VIEW_SOURCE_RAYS);
    shot_finish(&shot);
    job.camera.aperture = 0.1f;
    shot = shot_at(&job, scene, 0);
    assert_int_equal(shot.request.picture.view_source, VIEW_SOURCE_LAYERS);
    shot_finish(&shot);
    job.camera.aperture = 0;
    job.frame.picture.views_across = 2;
    shot = shot_at(&job, scene, 0);
    assert_int_equal(shot.request.picture.view_source, VIEW_SOURCE_LAYERS);
    shot_finish(&shot);
    scene_destroy(scene);
}

TEST(clips_move_the_view_of_a_camera_with_keys)
{
    struct scene *scene = turning_scene(90);
    struct draft_list list = {0};
    /* At 0 and 1 s. */
    add_clip(&list, 3, (float[]){0, 1, 3, 0, 4, 3, 0, 8, 0.4f, 0.8f, 2, 4, 1, 3, 9, 11}, 16);
    add_channel(&list, 10, 3, CHANNEL_VIEW_EYE, 0, 3, 2);
    add_channel(&list, 11, 3, CHANNEL_VIEW_FOV_Y, 0, 1, 2)->value.first_value = 8;
    add_channel(&list, 12, 3, CHANNEL_VIEW_APERTURE, 0, 1, 2)->value.first_value = 10;
    add_channel(&list, 13, 3, CHANNEL_VIEW_EXPOSURE, 0, 1, 2)->value.first_value = 12;
    add_clip(&list, 4, (float[]){0, 7}, 2);
    add_channel(&list, 14, 4, CHANNEL_VIEW_FOCUS, 0, 1, 1);
    expect_commit(scene, &list);
    struct record_clip_use uses[] = {{.clip = 3, .speed = 1}, {.clip = 4, .speed = 1}};
    struct engine_job job = job_of(CAMERA_KEYS, uses, 1);
    job.frame.picture.exposure_stops = 0.5f;
    struct shot shot = shot_at(&job, scene, 5);
    const struct frame_request *request = &shot.request;
    assert_true(request->camera.world_from_view[3] == 3.0f && request->camera.world_from_view[11] == 6.0f);
    assert_true(fabsf(request->camera.fov_y - 0.6f) < 1e-6f);
    assert_true(request->aperture == 3.0f && request->picture.exposure_stops == 2.5f);
    /* The camera still looks at the origin, sqrt(45) m away. */
    assert_true(fabsf(request->focus - sqrtf(45)) < 1e-5f);
    shot_finish(&shot);
    job.clip_count = 2;
    shot = shot_at(&job, scene, 5);
    assert_true(shot.request.focus == 7.0f);
    shot_finish(&shot);
    const enum camera_path others[] = {CAMERA_AUTO, CAMERA_NODE, CAMERA_ORBIT};
    for (int i = 0; i < 3; i++) {
        job = job_of(others[i], uses, 1);
        expect_refused(&job, scene, ERROR_INVALID, "render.camera_path");
    }
    job.camera.camera_path = CAMERA_KEYS;
    uses[0].clip = 9;
    expect_refused(&job, scene, ERROR_UNKNOWN_ID, "render.clips[0].clip");
    scene_destroy(scene);
}

TEST(a_lens_is_sharp_where_it_looks)
{
    struct scene *scene = turning_scene(90);
    struct record_clip_use use = {.clip = 1, .speed = 1};
    const enum camera_path paths[] = {CAMERA_AUTO, CAMERA_KEYS, CAMERA_ORBIT, CAMERA_NODE};
    for (int i = 0; i < 4; i++) {
        struct engine_job job = job_of(paths[i], &use, 1);
        struct shot shot = shot_at(&job, scene, 4);
        assert_true(shot.request.aperture == 0.0f && shot.request.focus == 0.0f); /* no lens */
        shot_finish(&shot);
        job.camera.aperture = 0.1f;
        shot = shot_at(&job, scene, 4);
        const float *m = shot.request.camera.world_from_view;
        /* The square's middle; keys look at the origin. The camera of node 3 has it behind it, at its side. */
        float to[3] = {0.5f - m[3], 0.5f - m[7], 0 - m[11]};
        float along = -(to[0] * m[2] + to[1] * m[6] + to[2] * m[10]);
        float expected = paths[i] == CAMERA_KEYS || paths[i] == CAMERA_ORBIT ? 5.0f : fmaxf(along, 0);
        assert_true(fabsf(shot.request.focus - expected) < 1e-4f);
        assert_true(paths[i] == CAMERA_NODE || expected > 0);
        shot_finish(&shot);
        job.camera.focus = 3;
        shot = shot_at(&job, scene, 4);
        assert_true(shot.request.aperture == 0.1f && shot.request.focus == 3.0f);
        shot_finish(&shot);
    }
    /* An orthographic camera has no lens. */
    struct draft_list list = {0};
    add_set(&list, OBJECT_CAMERA, 1)->set.camera.value.height = 1;
    expect_commit(scene, &list);
    struct engine_job job = job_of(CAMERA_NODE, &use, 1);
    job.camera.aperture = 0.1f;
    struct shot shot = shot_at(&job, scene, 4);
    assert_true(shot.request.aperture == 0.0f && shot.request.focus == 0.0f);
    shot_finish(&shot);
    scene_destroy(scene);
}

TEST(an_automatic_camera_shows_the_pose_at_time_0_in_all_frames)
{
    struct scene *scene = new_scene();
    struct draft_list list = {0};
    add_mesh(&list, 1);
    add_shown(&list, 1, NODE_MESH, 1);
    add_clip(&list, 1, (float[]){0, 1, 50, 0, 0, 90, 0, 0}, 8);
    add_channel(&list, 1, 1, CHANNEL_NODE_TRANSLATION, 1, 3, 2);
    expect_commit(scene, &list);
    struct record_clip_use use = {.clip = 1, .speed = 1, .start_s = -0.5f};
    struct engine_job job = job_of(CAMERA_AUTO, &use, 1);
    struct animation_bounds bounds = {0};
    struct frame_camera expected;
    const float degree = 0.017453293f;
    const struct frame_framing framing = {.azimuth = job.camera.auto_azimuth * degree,
                                          .elevation = job.camera.auto_elevation * degree,
                                          .fov_y = job.camera.auto_fov * degree,
                                          .margin = job.camera.auto_margin,
                                          .zoom = job.camera.auto_zoom};
    frame_camera_auto(&expected, &framing, (float[]){70, 0, 0}, (float[]){71, 1, 0}, 160.0f / 90);
    for (uint32_t frame = 0; frame < 20; frame += 3) {
        struct shot fresh = shot_at(&job, scene, frame), kept;
        assert_true(shot_make(&kept, &job, scene, frame, &bounds, NULL));
        assert_memory_equal(&fresh.request.camera, &expected, sizeof(expected));
        assert_memory_equal(&kept.request.camera, &expected, sizeof(expected));
        shot_finish(&fresh);
        shot_finish(&kept);
    }
    /* Poses that were kept are not used for another revision. */
    add_shown(&list, 2, NODE_MESH, 1);
    expect_commit(scene, &list);
    struct shot kept;
    assert_true(shot_make(&kept, &job, scene, 0, &bounds, NULL));
    assert_memory_not_equal(&kept.request.camera, &expected, sizeof(expected));
    shot_finish(&kept);
    scene_destroy(scene);
}

/* A clip that takes the mesh, 1 m high, down to y = -3 at its middle and up again: in every frame, of a part of
 * the job too, the ground lies there, a hair below. */
TEST(a_ground_lies_beneath_all_that_clips_do)
{
    struct scene *scene = new_scene();
    struct draft_list list = {0};
    add_mesh(&list, 1);
    add_shown(&list, 1, NODE_MESH, 1);
    add_clip(&list, 1, (float[]){0, 1, 2, 0, 0, 0, 0, -3, 0, 0, 0, 0}, 12);
    add_channel(&list, 1, 1, CHANNEL_NODE_TRANSLATION, 1, 3, 3);
    expect_commit(scene, &list);
    struct record_clip_use use = {.clip = 1, .speed = 1};
    struct engine_job job = job_of(CAMERA_AUTO, &use, 1);
    job.frame.picture.ground = true;
    job.frame.picture.ground_up_y = 2.0f;
    struct animation_bounds bounds = {0};
    for (uint32_t frame = 0; frame < 25; frame += 12) {
        struct shot fresh = shot_at(&job, scene, frame), kept;
        assert_true(shot_make(&kept, &job, scene, frame, &bounds, NULL));
        const struct frame_ground *ground = &fresh.request.ground;
        assert_memory_equal(ground, &kept.request.ground, sizeof(*ground));
        assert_true(ground->centre_world[1] < -3.0f && ground->centre_world[1] > -3.001f);
        assert_true(ground->normal_world[1] == 1.0f && ground->radius > 10.0f);
        shot_finish(&fresh);
        shot_finish(&kept);
    }
    /* The rest pose, without the clip; seen from x, its bounds begin at 0. */
    job.clip_count = 0;
    job.frame.picture.ground_up_x = 1.0f;
    job.frame.picture.ground_up_y = 0.0f;
    struct shot still = shot_at(&job, scene, 0);
    assert_true(fabsf(still.request.ground.centre_world[0]) < 1e-3f);
    shot_finish(&still);
    scene_destroy(scene);
}

TEST(noise_is_another_in_every_frame_but_in_none_that_accumulates)
{
    struct scene *scene = turning_scene(90);
    struct engine_job job = job_of(CAMERA_KEYS, NULL, 0);
    uint64_t seeds[200];
    for (uint32_t frame = 0; frame < 200; frame++) {
        struct shot shot = shot_at(&job, scene, frame);
        seeds[frame] = shot.request.sampling.seed;
        shot_finish(&shot);
        for (uint32_t before = 0; before < frame; before++)
            assert_true(seeds[before] != seeds[frame]);
    }
    assert_int_equal(seeds[0], 77);
    job.frame.sampling.accumulate = true;
    struct shot shot = shot_at(&job, scene, 150);
    assert_int_equal(shot.request.sampling.seed, 77);
    shot_finish(&shot);
    scene_destroy(scene);
}

TEST(a_given_camera_sees_the_scene_of_that_time)
{
    struct scene *scene = new_scene();
    struct draft_list list = {0};
    add_turning(&list, 90);
    add_clip(&list, 3, (float[]){0, 9, 9, 9, 0.25f}, 5);
    struct scene_channel *eye = add_channel(&list, 4, 3, CHANNEL_VIEW_EYE, 0, 3, 1);
    eye->value.first_value = 1;
    struct scene_channel *aperture = add_channel(&list, 5, 3, CHANNEL_VIEW_APERTURE, 0, 1, 1);
    aperture->value.first_value = 4;
    expect_commit(scene, &list);
    struct record_clip_use uses[] = {{.clip = 1, .speed = 1}, {.clip = 3, .speed = 1}};
    struct engine_job job = job_of(CAMERA_KEYS, uses, 2);
    struct shot frame = shot_at(&job, scene, 5), look;
    struct view_camera from = {.command = 1, .key = home};
    from.key.time_s = 0.5f;
    assert_true(shot_make_at(&look, &job, scene, &from, NULL, NULL));
    assert_true(look.time_s == frame.time_s);
    assert_int_equal(look.motion.pose_count, frame.motion.pose_count);
    assert_memory_equal(look.motion.poses[0].nodes[0].parent_from_node,
                        frame.motion.poses[0].nodes[0].parent_from_node, 48);
    assert_true(frame.request.camera.world_from_view[3] == 9.0f);
    assert_true(look.request.camera.world_from_view[3] == 0.0f);
    assert_true(look.request.camera.world_from_view[11] == 5.0f);
    assert_true(look.request.aperture == 0.25f);
    assert_true(look.request.focus == 5.0f);
    assert_int_equal(look.request.sampling.seed, 77); /* from one place there is one picture */
    shot_finish(&frame);
    shot_finish(&look);
    struct error error = {0};
    memcpy(from.key.up_world, (float[]){0, 0, 2}, 12); /* along the view */
    assert_false(shot_make_at(&look, &job, scene, &from, NULL, &error));
    assert_int_equal(error.kind, ERROR_INVALID);
    assert_string_equal(error.field, "view_camera.up_world");
    scene_destroy(scene);
}

TEST(a_view_through_a_camera_of_the_scene_shows_what_a_job_along_it_does)
{
    struct scene *scene = turning_scene(90);
    struct record_clip_use use = {.clip = 1, .speed = 1};
    struct engine_job along = job_of(CAMERA_NODE, &use, 1), watched = job_of(CAMERA_KEYS, &use, 1);
    along.camera.aperture = watched.camera.aperture = 0.5f; /* both have the same focus */
    for (uint32_t frame = 0; frame <= 10; frame += 5) {
        struct shot expected = shot_at(&along, scene, frame), look;
        struct view_camera from = {.command = 1, .key = home, .node = 3};
        from.key.time_s = expected.time_s;
        assert_true(shot_make_at(&look, &watched, scene, &from, NULL, NULL));
        assert_memory_equal(&look.request.camera, &expected.request.camera, sizeof(look.request.camera));
        assert_true(look.request.focus == expected.request.focus);
        shot_finish(&expected);
        shot_finish(&look);
    }
    static const struct {
        uint32_t node;
        enum error_code kind;
    } refused[] = {{99, ERROR_UNKNOWN_ID}, {1, ERROR_INVALID}};
    for (size_t i = 0; i < 2; i++) {
        struct error error = {0};
        struct shot look;
        struct view_camera from = {.command = 1, .key = home, .node = refused[i].node};
        assert_false(shot_make_at(&look, &watched, scene, &from, NULL, &error));
        assert_int_equal(error.kind, refused[i].kind);
        assert_string_equal(error.field, "view_camera.node");
    }
    scene_destroy(scene);
}

/* ---- ranges -------------------------------------------------------------------------------------- */

/* Properties of a shown frame, whichever job it comes from. */
struct record {
    struct frame_request request;
    uint64_t motion;
    uint32_t poses;
    float time_s, shutter_s;
    bool seen;
};

#define FRAMES 24

static void commit_turning(void)
{
    struct engine_command *made = command(ENGINE_COMMIT, 1, 2);
    struct draft_list list = {0};
    add_turning(&list, 120);
    made->edits = calloc(list.count, sizeof(*made->edits));
    assert_non_null(made->edits);
    memcpy(made->edits, list.edits, list.count * sizeof(*made->edits));
    made->edit_count = list.count;
    submit(made);
    expect_done(1, 2);
}

static void run_range(uint32_t request, uint32_t first, uint32_t last, uint32_t step,
                      struct record records[FRAMES])
{
    struct engine_command *made = render(1, request, first, last);
    made->job.frame_step = step;
    made->job.camera.shutter = 0.5f;
    made->job.camera.aperture = 0.25f;
    made->job.clip_count = 2;
    made->job.clips = calloc(2, sizeof(*made->job.clips));
    assert_non_null(made->job.clips);
    made->job.clips[0] = (struct record_clip_use){.clip = 1, .speed = 1.5f, .loop = true};
    made->job.clips[1] = (struct record_clip_use){.clip = 2, .speed = 1, .start_s = 0.25f};
    submit(made);
    for (uint32_t frame = first; frame <= last; frame += step) {
        struct engine_event *event = expect_frame(1, request, frame);
        const struct engine_frame *got = event->frame;
        records[frame] = (struct record){got->request, got->result.splits, (uint32_t)got->result.structure_bytes,
                                         got->time_s,  got->shutter_s,     true};
        engine_event_destroy(event);
    }
    expect_done(1, request);
}

static void expect_same(const struct record *whole, const struct record *part, uint32_t frame)
{
    const struct frame_request *a = &whole->request, *b = &part->request;
    assert_true(part->seen);
    if (whole->motion != part->motion || whole->poses != part->poses)
        fail_msg("frame %u shows another motion", frame);
    assert_memory_equal(a->camera.world_from_view, b->camera.world_from_view, sizeof(a->camera.world_from_view));
    assert_true(a->camera.fov_y == b->camera.fov_y && a->aperture == b->aperture && a->focus == b->focus);
    assert_true(a->sampling.seed == b->sampling.seed && a->picture.exposure_stops == b->picture.exposure_stops);
    assert_true(whole->time_s == part->time_s && whole->shutter_s == part->shutter_s);
}

TEST_WITH(frames_show_the_same_however_their_range_was_divided, start_engine, stop_engine)
{
    open_scene(1, 1);
    commit_turning();
    struct record whole[FRAMES] = {0}, shards[FRAMES] = {0}, resumed[FRAMES] = {0};
    run_range(10, 0, FRAMES - 1, 1, whole);
    for (uint32_t shard = 0; shard < 3; shard++)
        run_range(11, 2 - shard, FRAMES - 1, 3, shards);
    run_range(12, 17, FRAMES - 1, 1, resumed);
    run_range(12, 0, 16, 1, resumed);
    for (uint32_t frame = 0; frame < FRAMES; frame++) {
        assert_true(whole[frame].poses >= 1 && whole[frame].motion != 0);
        assert_true(frame == 0 || whole[frame].motion != whole[frame - 1].motion);
        expect_same(&whole[frame], &shards[frame], frame);
        expect_same(&whole[frame], &resumed[frame], frame);
    }
    assert_true(whole[1].shutter_s == 0.5f / 24 && whole[1].request.focus > 0);
}

TEST_WITH(a_clip_that_goes_ends_the_job_and_says_which, start_engine, stop_engine)
{
    restart((struct engine_options){.frames_in_flight = 1});
    open_scene(1, 1);
    commit_turning();
    struct engine_command *made = gated(render(1, 10, 0, 9));
    made->job.clip_count = 1;
    made->job.clips = calloc(1, sizeof(*made->job.clips));
    assert_non_null(made->job.clips);
    made->job.clips[0] = (struct record_clip_use){.clip = 2, .speed = 1};
    submit(made);
    wait_until(&fake.frames_begun, 1);
    struct engine_command *removal = command(ENGINE_COMMIT, 1, 11);
    removal->edits = calloc(1, sizeof(*removal->edits));
    assert_non_null(removal->edits);
    removal->edits[0] = (struct scene_edit){.kind = EDIT_REMOVE, .object = OBJECT_CLIP, .id = 2};
    removal->edit_count = 1;
    submit(removal);
    expect_silence();
    atomic_store(&fake.gate_open, true);
    bool removed = false, ended = false;
    for (int events = 0; events < 3; events++) {
        struct engine_event *event = next_event();
        removed = removed || (event->kind == ENGINE_DONE && event->request == 11);
        if (event->kind == ENGINE_FAILED) {
            assert_string_equal(event->error.field, "render.clips[0].clip");
            ended = true;
        }
        engine_event_destroy(event);
    }
    assert_true(removed && ended);
}
