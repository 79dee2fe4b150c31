/* SPDX-License-Identifier: MIT */
/* Poses that clips make of a scene, against what geometry says. */
#include "tests/unit/scene/scene_fixture.h"

#include "scene/pose.h"

#define PI 3.14159265358979323846

EACH_TEST(begin_scene, end_scene)

static struct scene_pose pose_at(const struct record_clip_use *uses, uint32_t count, double time_s)
{
    struct scene_pose pose;
    struct error error = {0};
    if (!scene_pose_evaluate(&pose, scene, uses, count, time_s, &error))
        fail_msg("%s: %s", error.field, error.text);
    return pose;
}

static const struct record_clip_use plain_use = {.clip = 1, .speed = 1};

/* Where a node's own point is at a time while clip 1 plays. */
static void expect_place(uint32_t node, double time_s, const float point[3], const double expected[3])
{
    struct scene_pose pose = pose_at(&plain_use, 1, time_s);
    float m[12], got[3];
    assert_true(scene_world_from_node(scene, &pose, node, m));
    for (int row = 0; row < 3; row++)
        got[row] = m[4 * row] * point[0] + m[4 * row + 1] * point[1] + m[4 * row + 2] * point[2] + m[4 * row + 3];
    expect_near("place", got, expected, 3, 1e-5);
    scene_pose_finish(&pose);
}

/* Quarter turns about z for each second: keys at 0, 1 and 2 s. */
static const float quarter_turns[15] = {0, 1, 2, 0, 0, 0, 1, 0, 0, 0.70710678f, 0.70710678f, 0, 0, 1, 0};

/* ---- parts of a transform ----------------------------------------------------------------------- */

TEST(a_part_that_no_channel_gives_is_that_of_the_node)
{
    /* Turned by 90 degrees about x, scaled by 2, 3, -4: a mirror; and moved. */
    const float mirrored[12] = {2, 0, 0, 10, 0, 0, 4, 20, 0, 3, 0, 30};
    for (uint32_t node = 1; node <= 3; node++)
        memcpy(add_node(&list, node, 0)->value.parent_from_node, mirrored, sizeof(mirrored));
    add_clip(&list, 1, (float[]){0, 1, 1, 2, 3, 5, 6, 7}, 8);
    add_channel(&list, 1, 1, CHANNEL_NODE_TRANSLATION, 1, 3, 2);
    add_channel(&list, 2, 1, CHANNEL_NODE_SCALE, 2, 3, 2);
    expect_commit(scene, &list);
    /* Moved: nothing else changes. */
    struct scene_pose pose = pose_at(&plain_use, 1, 0.5);
    assert_int_equal(pose.node_count, 2);
    const double moved[12] = {2, 0, 0, 3, 0, 0, 4, 4, 0, 3, 0, 5};
    expect_near("moved", scene_pose_parent_from_node(&pose, scene_node(scene, 1)), moved, 12, 1e-6);
    /* Scaled: the mirror lies in the scale, as -2 3 4 of a turn that takes x to -x; a scale of 1 2 3 is none. */
    scene_pose_finish(&pose);
    pose = pose_at(&plain_use, 1, 0);
    const double scaled[12] = {-1, 0, 0, 10, 0, 0, 3, 20, 0, 2, 0, 30};
    expect_near("scaled", scene_pose_parent_from_node(&pose, scene_node(scene, 2)), scaled, 12, 1e-6);
    /* Node 3 is in no clip. */
    assert_ptr_equal(scene_pose_parent_from_node(&pose, scene_node(scene, 3)),
                     scene_node(scene, 3)->value.parent_from_node);
    scene_pose_finish(&pose);
}

TEST(a_turned_mirror_stays_a_mirror_and_keeps_its_size)
{
    const float mirrored[12] = {0, 3, 0, 1, 2, 0, 0, 2, 0, 0, 4, 3}; /* determinant -24 */
    memcpy(add_node(&list, 1, 0)->value.parent_from_node, mirrored, sizeof(mirrored));
    add_clip(&list, 1, quarter_turns, 15);
    add_channel(&list, 1, 1, CHANNEL_NODE_ROTATION, 1, 4, 3);
    expect_commit(scene, &list);
    struct scene_pose pose = pose_at(&plain_use, 1, 0.7);
    const float *m = scene_pose_parent_from_node(&pose, scene_node(scene, 1));
    /* Scale -2 3 4 turned by 63 degrees about z. */
    double c = cos(0.7 * PI / 2), s = sin(0.7 * PI / 2);
    const double expected[12] = {-2 * c, -3 * s, 0, 1, -2 * s, 3 * c, 0, 2, 0, 0, 4, 3};
    expect_near("turned", m, expected, 12, 1e-6);
    scene_pose_finish(&pose);
}

TEST(a_flat_node_can_be_scaled_up_again)
{
    const float flat[12] = {0, 0, 0, 0, 0, 0, 5, 0, 0, -5, 0, 0}, point[12] = {0};
    memcpy(add_node(&list, 1, 0)->value.parent_from_node, flat, sizeof(flat));
    memcpy(add_node(&list, 2, 0)->value.parent_from_node, point, sizeof(point));
    add_clip(&list, 1, (float[]){0, 1, 2, 3}, 4);
    add_channel(&list, 1, 1, CHANNEL_NODE_SCALE, 1, 3, 1);
    add_channel(&list, 2, 1, CHANNEL_NODE_SCALE, 2, 3, 1);
    expect_commit(scene, &list);
    struct scene_pose pose = pose_at(&plain_use, 1, 0);
    /* The column without a direction is at right angles to the others: y to -z, z to y, so x to x. */
    const double upright[12] = {1, 0, 0, 0, 0, 0, 3, 0, 0, -2, 0, 0};
    expect_near("one direction", scene_pose_parent_from_node(&pose, scene_node(scene, 1)), upright, 12, 1e-6);
    const double from_nothing[12] = {1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 3, 0};
    expect_near("no direction", scene_pose_parent_from_node(&pose, scene_node(scene, 2)), from_nothing, 12, 1e-6);
    scene_pose_finish(&pose);
}

TEST(what_hangs_below_moves_along)
{
    /* An arm of two bones of length 1 and 2 along x; both turn by a quarter a second. */
    add_node(&list, 1, 0);
    add_node(&list, 2, 1)->value.parent_from_node[3] = 1;
    add_clip(&list, 1, quarter_turns, 15);
    add_channel(&list, 1, 1, CHANNEL_NODE_ROTATION, 1, 4, 3);
    add_channel(&list, 2, 1, CHANNEL_NODE_ROTATION, 2, 4, 3);
    expect_commit(scene, &list);
    const float tip[3] = {2, 0, 0};
    for (double t = 0; t <= 2; t += 0.125) {
        double a = t * PI / 2, b = 2 * a;
        expect_place(2, t, tip, (double[]){cos(a) + 2 * cos(b), sin(a) + 2 * sin(b), 0});
    }
}

/* ---- time --------------------------------------------------------------------------------------- */

TEST(clips_begin_end_repeat_and_run_at_their_speed)
{
    add_node(&list, 1, 0);
    /* Two channels: the clip is as long as the longer one, 4 s. */
    add_clip(&list, 1, (float[]){1, 3, 10, 0, 0, 30, 0, 0, 4, 1, 1, 1}, 12);
    add_channel(&list, 1, 1, CHANNEL_NODE_TRANSLATION, 1, 3, 2);
    struct scene_channel *last = add_channel(&list, 2, 1, CHANNEL_NODE_SCALE, 1, 3, 1);
    last->value.first_time = 8;
    last->value.first_value = 9;
    expect_commit(scene, &list);
    assert_true(scene_clip_duration_s(scene, 1) == 4.0);
    assert_true(scene_clip_duration_s(scene, 9) == 0.0);
    const struct {
        struct record_clip_use use;
        double time_s, x;
    } cases[] = {
        {{.clip = 1, .speed = 1}, -7, 10},
        {{.clip = 1, .speed = 1}, 0, 10},
        {{.clip = 1, .speed = 1}, 2, 20},
        {{.clip = 1, .speed = 1}, 100, 30},
        {{.clip = 1, .speed = 1, .start_s = 10}, 9, 10},
        {{.clip = 1, .speed = 1, .start_s = 10}, 12, 20},
        {{.clip = 1, .speed = 0.5f, .start_s = 10}, 14, 20},
        {{.clip = 1, .speed = 4, .start_s = -1}, -0.5, 20},
        {{.clip = 1, .speed = 1, .loop = true}, 4 * 1000 + 2.5, 25},
        {{.clip = 1, .speed = 1, .loop = true}, 3.5, 30},
        {{.clip = 1, .speed = 1, .loop = true}, -2, 10},
        {{.clip = 1, .speed = 2, .start_s = 1, .loop = true}, 1 + 2 * 7 + 1, 20},
    };
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct scene_pose pose = pose_at(&cases[i].use, 1, cases[i].time_s);
        double x = (double)scene_pose_parent_from_node(&pose, scene_node(scene, 1))[3];
        if (!(fabs(x - cases[i].x) < 1e-5))
            fail_msg("case %zu: %g, expected %g", i, x, cases[i].x);
        scene_pose_finish(&pose);
    }
}

TEST(of_two_clips_that_change_the_same_the_later_one_counts)
{
    add_node(&list, 1, 0);
    add_clip(&list, 7, (float[]){0, 1, 2, 3}, 4);
    add_clip(&list, 8, (float[]){0, 4, 5, 6}, 4);
    add_channel(&list, 1, 7, CHANNEL_NODE_TRANSLATION, 1, 3, 1);
    add_channel(&list, 2, 7, CHANNEL_NODE_SCALE, 1, 3, 1);
    add_channel(&list, 3, 8, CHANNEL_NODE_TRANSLATION, 1, 3, 1);
    expect_commit(scene, &list);
    const struct record_clip_use orders[][3] = {{{7, 0, 1, false}, {8, 0, 1, false}},
                                                {{8, 0, 1, false}, {7, 0, 1, false}},
                                                {{8, 0, 1, false}, {7, 0, 1, false}, {8, 0, 1, false}}};
    const uint32_t counts[] = {2, 2, 3};
    const double places[][3] = {{4, 5, 6}, {1, 2, 3}, {4, 5, 6}};
    for (int i = 0; i < 3; i++) {
        struct scene_pose pose = pose_at(orders[i], counts[i], 0);
        const float *m = scene_pose_parent_from_node(&pose, scene_node(scene, 1));
        const double expected[12] = {1, 0, 0, places[i][0], 0, 2, 0, places[i][1], 0, 0, 3, places[i][2]};
        expect_near("pose", m, expected, 12, 1e-6);
        scene_pose_finish(&pose);
    }
    struct scene_pose pose;
    struct error error = {0};
    const struct record_clip_use unknown[] = {{.clip = 7, .speed = 1}, {.clip = 9, .speed = 1}};
    assert_false(scene_pose_evaluate(&pose, scene, unknown, 2, 0, &error));
    assert_int_equal(error.kind, ERROR_UNKNOWN_ID);
    assert_string_equal(error.field, "clips[1].clip");
}

/* ---- all that is not a place ---------------------------------------------------------------------- */

TEST(lights_materials_and_the_view_stay_within_what_the_protocol_allows)
{
    const enum channel_path lights[] = {CHANNEL_LIGHT_COLOUR, CHANNEL_LIGHT_SIZE};
    const enum channel_path materials[] = {CHANNEL_MATERIAL_BASE_COLOUR,  CHANNEL_MATERIAL_EMISSION,
                                           CHANNEL_MATERIAL_METALLIC,     CHANNEL_MATERIAL_ROUGHNESS,
                                           CHANNEL_MATERIAL_TRANSMISSION, CHANNEL_MATERIAL_IOR};
    const enum channel_path views[] = {CHANNEL_VIEW_EYE,     CHANNEL_VIEW_LOOK_AT,  CHANNEL_VIEW_UP,
                                       CHANNEL_VIEW_FOV_Y,   CHANNEL_VIEW_APERTURE, CHANNEL_VIEW_FOCUS,
                                       CHANNEL_VIEW_EXPOSURE};
    const uint32_t widths[] = {3, 2, 4, 3, 1, 1, 1, 1, 3, 3, 3, 1, 1, 1, 1};
    /* From far below to far above. */
    add_clip(&list, 1, (float[]){0, 2, -3e38f, -3e38f, -3e38f, -3e38f, 3e38f, 3e38f, 3e38f, 3e38f}, 10);
    struct scene_light *light = &add_set(&list, OBJECT_LIGHT, 1)->set.light;
    light->value.kind = LIGHT_SPHERE;
    light->value.size[0] = 1;
    add_set(&list, OBJECT_MATERIAL, 1)->set.material.value.alpha_cutoff = 0.25f;
    for (uint32_t i = 0; i < 15; i++) {
        enum channel_path path = i < 2 ? lights[i] : i < 8 ? materials[i - 2] : views[i - 8];
        add_channel(&list, i + 1, 1, path, i < 8, widths[i], 2)->value.first_value = 6 - widths[i];
    }
    expect_commit(scene, &list);
    struct scene_pose low = pose_at(&plain_use, 1, 0), high = pose_at(&plain_use, 1, 2);
    assert_int_equal(low.light_count, 1);
    assert_int_equal(low.material_count, 1);
    assert_int_equal(low.node_count, 0);
    const struct scene_light *dark = scene_pose_light(&low, scene_light(scene, 1)),
                             *bright = scene_pose_light(&high, scene_light(scene, 1));
    assert_true(dark->value.kind == LIGHT_SPHERE && dark->value.colour[1] == 0.0f &&
                bright->value.colour[1] == 1e12f);
    assert_true(dark->value.size[0] > 0.0f && dark->value.size[0] <= 1e-6f && bright->value.size[0] == 1e12f);
    const struct scene_material *a = scene_pose_material(&low, scene_material(scene, 1)),
                                *b = scene_pose_material(&high, scene_material(scene, 1));
    assert_true(a->value.base_colour[3] == 0.0f && b->value.base_colour[3] == 1.0f);
    assert_true(a->value.emission[0] == 0.0f && b->value.emission[0] == 1e6f);
    assert_true(a->value.metallic == 0.0f && a->value.roughness == 0.0f && a->value.transmission == 0.0f &&
                a->value.ior == 1.0f);
    assert_true(b->value.metallic == 1.0f && b->value.roughness == 1.0f && b->value.transmission == 1.0f &&
                b->value.ior == 10.0f);
    assert_true(a->value.alpha_cutoff == 0.25f);
    assert_true(scene_material(scene, 1)->value.emission[0] == 0.0f);
    assert_int_equal(low.view.given, 127);
    assert_true(low.view.eye_world[2] == -1e12f && high.view.look_at_world[0] == 1e12f);
    assert_true(low.view.up_world[1] == -1e6f && high.view.up_world[1] == 1e6f);
    assert_true(low.view.fov_y == 0.001f && high.view.fov_y == 3.1f);
    assert_true(low.view.aperture == 0.0f && high.view.focus == 1e12f);
    assert_true(low.view.exposure_stops == -64.0f && high.view.exposure_stops == 64.0f);
    scene_pose_finish(&low);
    scene_pose_finish(&high);
    /* Without a pose, and in one that has nothing of them, they are as they were committed. */
    struct scene_pose nothing = {0};
    assert_ptr_equal(scene_pose_light(&nothing, scene_light(scene, 1)), scene_light(scene, 1));
    assert_ptr_equal(scene_pose_material(NULL, scene_material(scene, 1)), scene_material(scene, 1));
}

TEST(a_node_is_hidden_from_a_half_on_and_all_below_with_it)
{
    add_mesh(&list, 1);
    add_node(&list, 1, 0)->value.hidden = true;
    add_shown(&list, 2, NODE_MESH, 1)->value.parent = 1;
    add_clip(&list, 1, (float[]){0, 1, 1, 0}, 4);
    add_channel(&list, 1, 1, CHANNEL_NODE_HIDDEN, 1, 1, 2);
    expect_commit(scene, &list);
    for (int i = 0; i < 8; i++) {
        struct scene_pose pose = pose_at(&plain_use, 1, i / 8.0);
        struct scene_instance *instances;
        size_t count;
        assert_true(scene_flatten(scene, &pose, NODE_MESH, &instances, &count));
        assert_int_equal(count, i > 4);
        /* Where it is does not change by that, not even in the last bit. */
        assert_memory_equal(scene_pose_parent_from_node(&pose, scene_node(scene, 1)),
                            scene_node(scene, 1)->value.parent_from_node, 48);
        free(instances);
        scene_pose_finish(&pose);
    }
}

TEST(weights_come_from_the_clip_the_node_or_the_mesh)
{
    float targets[36] = {0};
    struct scene_mesh *mesh = add_targets(add_mesh(&list, 1), targets, 3);
    mesh->weights = make_weights((float[]){0.5f}, 1);
    mesh->weight_count = 1;
    add_shown(&list, 1, NODE_MESH, 1);
    struct scene_node *node = add_shown(&list, 2, NODE_MESH, 1);
    node->weights = make_weights((float[]){1, 2, 3, 4}, 4);
    node->weight_count = 4;
    add_shown(&list, 3, NODE_MESH, 1);
    add_clip(&list, 1, (float[]){0, 2, 0, 10, 1, 30}, 6);
    add_channel(&list, 1, 1, CHANNEL_NODE_WEIGHTS, 3, 2, 2);
    add_channel(&list, 2, 1, CHANNEL_NODE_WEIGHTS, 2, 1, 2);
    expect_commit(scene, &list);
    struct scene_pose pose = pose_at(&plain_use, 1, 1);
    const double expected[3][3] = {{0.5, 0, 0}, {5, 0, 0}, {0.5, 20, 0}};
    for (uint32_t i = 0; i < 3; i++) {
        float weights[3];
        scene_pose_weights(&pose, scene_node(scene, i + 1), scene_mesh(scene, 1), weights);
        expect_near("with a clip", weights, expected[i], 3, 1e-6);
    }
    float weights[3];
    scene_pose_weights(NULL, scene_node(scene, 2), scene_mesh(scene, 1), weights);
    expect_near("the node's", weights, (double[]){1, 2, 3}, 3, 0);
    scene_pose_finish(&pose);
}
