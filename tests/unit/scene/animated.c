/* SPDX-License-Identifier: MIT */
/* Transactions with skins, morph targets and clips: what they refuse, what falls along, what they touch. */
#include "tests/unit/scene/scene_fixture.h"

#include <float.h>

static const uint16_t two_joints[8] = {0, 1, 0, 1, 0, 1, 0, 1};
static const float halves[8] = {1, 1, 1, 1, 1, 1, 1, 1};
static const float lifts[24] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 2, 0, 0, 2, 0, 0, 2, 0, 0, 2};
/* Two keys of three numbers. */
static const float keys[8] = {0, 1, 1, 2, 3, 4, 5, 6};

/* Nodes 1 and 2 are the joints of skin 1, which moves mesh 1 at node 3; clip 1 moves node 1 (channel 1), light 1
 * (channel 2), material 1 (channel 3) and the view (channel 4). */
static int begin_animated(void **state)
{
    begin_scene(state);
    add_node(&list, 1, 0);
    add_node(&list, 2, 1);
    add_shown(&list, 3, NODE_MESH, 1)->value.skin = 1;
    add_targets(add_joints(add_mesh(&list, 1), two_joints, halves), lifts, 2);
    add_skin(&list, 1, (uint32_t[]){1, 2}, 2);
    add_set(&list, OBJECT_LIGHT, 1);
    add_set(&list, OBJECT_MATERIAL, 1);
    add_clip(&list, 1, keys, 8);
    add_channel(&list, 1, 1, CHANNEL_NODE_TRANSLATION, 1, 3, 2);
    add_channel(&list, 2, 1, CHANNEL_LIGHT_COLOUR, 1, 3, 2);
    add_channel(&list, 3, 1, CHANNEL_MATERIAL_EMISSION, 1, 3, 2);
    add_channel(&list, 4, 1, CHANNEL_VIEW_EYE, 0, 3, 2);
    expect_commit(scene, &list);
    return 0;
}

EACH_TEST(begin_animated, end_scene)

/* ---- one object --------------------------------------------------------------------------------- */

TEST_WITH(joints_and_targets_come_with_all_they_need, begin_scene, end_scene)
{
    struct scene_mesh *mesh = add_mesh(&list, 7);
    mesh->value.influence_count = 2;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 7).arrays[7] (joints)");
    mesh = add_joints(add_mesh(&list, 7), two_joints, halves);
    blob_unref(mesh->arrays[MESH_WEIGHTS]);
    mesh->arrays[MESH_WEIGHTS] = NULL;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 7).arrays[8] (joint weights)");
    mesh = add_joints(add_mesh(&list, 7), two_joints, halves);
    mesh->value.influence_count = 0;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 7).arrays[7] (joints)");
    mesh = add_mesh(&list, 7);
    mesh->value.target_count = 1;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 7).arrays[9] (target positions)");
    for (int array = MESH_TARGET_POSITIONS; array <= MESH_TARGET_TANGENTS; array++) {
        const char *names[] = {"target positions", "target normals", "target tangents"};
        char field[64];
        snprintf(field, sizeof(field), "edits[0] (mesh 7).arrays[%d] (%s)", array, names[array - 9]);
        mesh = add_mesh(&list, 7);
        mesh->arrays[array] = make_blob(lifts, 48);
        expect_refusal(scene, &list, ERROR_INVALID, field); /* no targets */
        mesh = add_targets(add_mesh(&list, 7), lifts, 2);
        blob_unref(mesh->arrays[array]);
        mesh->arrays[array] = make_blob(lifts, 92);
        expect_refusal(scene, &list, ERROR_INVALID, field); /* too short */
        float bad[24] = {0};
        bad[17] = NAN;
        mesh = add_targets(add_mesh(&list, 7), lifts, 2);
        blob_unref(mesh->arrays[array]);
        mesh->arrays[array] = make_blob(bad, 96);
        expect_refusal(scene, &list, ERROR_INVALID, field);
    }
}

TEST_WITH(joints_fit_their_counts_and_weights_are_not_negative, begin_scene, end_scene)
{
    add_joints(add_mesh(&list, 7), two_joints, halves)->value.influence_count = 1;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 7).arrays[7] (joints)");
    add_joints(add_mesh(&list, 7), two_joints, halves)->value.influence_count = UINT32_MAX;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 7).influence_count");
    add_targets(add_mesh(&list, 7), lifts, 2)->value.target_count = UINT32_MAX;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 7).target_count");
    const float bad[] = {-1e-30f, NAN, INFINITY, 2e18f};
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
        float weights[8] = {0, 0, 0, 0, 0, bad[i], 0, 0};
        add_joints(add_mesh(&list, 7), two_joints, weights);
        expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 7).arrays[8] (joint weights)");
    }
    struct scene_mesh *mesh = add_mesh(&list, 7);
    mesh->weights = make_weights((float[]){0, INFINITY}, 2);
    mesh->weight_count = 2;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 7).weights[1]");
    struct scene_node *node = add_node(&list, 7, 0);
    node->weights = make_weights((float[]){NAN}, 1);
    node->weight_count = 1;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (node 7).weights[0]");
    add_node(&list, 7, 0)->value.skin = 1;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (node 7).skin"); /* shows no mesh */
}

TEST(skins_clips_and_channels_make_sense_alone)
{
    const uint32_t joints[] = {1, 2};
    float matrices[24] = {0};
    add_skin(&list, 5, joints, 2)->value.joint_count = 0;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (skin 5).joint_count");
    add_skin(&list, 5, joints, 2)->value.joint_count = SKIN_JOINTS_MAX + 1;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (skin 5).joint_count");
    add_skin(&list, 5, joints, 2)->value.joint_count = 3;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (skin 5).arrays[0] (joints)");
    add_set(&list, OBJECT_SKIN, 5)->set.skin.value.joint_count = 2;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (skin 5).arrays[0] (joints)");
    add_skin(&list, 5, joints, 2)->joint_from_mesh = make_blob(matrices, 48);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (skin 5).arrays[1] (joint_from_mesh)");
    matrices[23] = INFINITY;
    add_skin(&list, 5, joints, 2)->joint_from_mesh = make_blob(matrices, 96);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (skin 5).arrays[1] (joint_from_mesh)");
    add_set(&list, OBJECT_CLIP, 5);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (clip 5).arrays[0] (times and values)");
    add_set(&list, OBJECT_CLIP, 5)->set.clip.floats = make_blob(keys, 7);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (clip 5).arrays[0] (times and values)");
    add_clip(&list, 5, (float[]){0, NAN}, 2);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (clip 5).arrays[0] (times and values)");
    add_channel(&list, 5, 1, (enum channel_path)7, 1, 3, 2);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).path");
    add_channel(&list, 5, 1, (enum channel_path)1000, 1, 3, 2);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).path");
    add_channel(&list, 5, 1, CHANNEL_NODE_SCALE, 1, 3, 2)->value.interpolation = (enum interpolation)5;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).interpolation");
    add_channel(&list, 5, 1, CHANNEL_NODE_ROTATION, 1, 3, 2);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).width");
    add_channel(&list, 5, 1, CHANNEL_NODE_WEIGHTS, 1, 1025, 2);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).width");
    add_channel(&list, 5, 1, CHANNEL_NODE_SCALE, 1, 3, 0);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).key_count");
    add_channel(&list, 5, 1, CHANNEL_VIEW_EYE, 1, 3, 2);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).object");
}

/* ---- several ------------------------------------------------------------------------------------ */

TEST(skins_and_channels_refer_to_existing_objects)
{
    add_skin(&list, 5, (uint32_t[]){2, 9}, 2);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (skin 5).arrays[0] (joints)[1]");
    add_skin(&list, 5, (uint32_t[]){0, 2}, 2);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (skin 5).arrays[0] (joints)[0]");
    add_shown(&list, 4, NODE_MESH, 1)->value.skin = 9;
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (node 4).skin");
    add_channel(&list, 5, 9, CHANNEL_NODE_SCALE, 1, 3, 2);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (channel 5).clip");
    const enum channel_path paths[] = {CHANNEL_NODE_SCALE, CHANNEL_LIGHT_COLOUR, CHANNEL_MATERIAL_EMISSION};
    for (int i = 0; i < 3; i++) {
        add_channel(&list, 5, 1, paths[i], 9, 3, 2);
        expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (channel 5).object");
        add_channel(&list, 5, 1, paths[i], 0, 3, 2);
        expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (channel 5).object");
    }
    /* An object that is removed in the same transaction is not there. */
    add_remove(&list, OBJECT_NODE, 3);
    add_channel(&list, 5, 1, CHANNEL_NODE_SCALE, 3, 3, 2);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[1] (channel 5).object");
    add_remove(&list, OBJECT_NODE, 1); /* with it goes node 2 */
    add_remove(&list, OBJECT_NODE, 3);
    add_channel(&list, 5, 1, CHANNEL_NODE_SCALE, 2, 3, 2);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[2] (channel 5).object");
    add_remove(&list, OBJECT_NODE, 1);
    add_remove(&list, OBJECT_NODE, 3);
    add_skin(&list, 1, (uint32_t[]){2}, 1);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[2] (skin 1).arrays[0] (joints)[0]");
}

TEST(channels_have_their_numbers_in_their_clips)
{
    add_channel(&list, 5, 1, CHANNEL_NODE_SCALE, 1, 3, 2)->value.first_time = 7;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).first_time");
    add_channel(&list, 5, 1, CHANNEL_NODE_SCALE, 1, 3, 2)->value.first_time = UINT32_MAX;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).first_time");
    add_channel(&list, 5, 1, CHANNEL_NODE_SCALE, 1, 3, 2)->value.key_count = UINT32_MAX;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).first_time");
    add_channel(&list, 5, 1, CHANNEL_NODE_SCALE, 1, 3, 2)->value.first_value = 3;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).first_value");
    add_channel(&list, 5, 1, CHANNEL_NODE_SCALE, 1, 3, 2)->value.first_value = UINT32_MAX;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).first_value");
    const enum interpolation three_values[] = {INTERPOLATION_CUBIC_SPLINE, INTERPOLATION_BEZIER};
    for (int i = 0; i < 2; i++) {
        add_channel(&list, 5, 1, CHANNEL_NODE_SCALE, 1, 3, 2)->value.interpolation = three_values[i];
        expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).first_value");
    }
    /* 1, 1: the third and fourth number of the clip. */
    add_channel(&list, 5, 1, CHANNEL_NODE_SCALE, 1, 3, 2)->value.first_time = 1;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (channel 5).first_time");
    /* A clip that is set again must do for the channels that it has. */
    add_clip(&list, 1, keys, 7);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (clip 1).arrays[0] (times and values)");
    add_clip(&list, 1, (float[]){2, 1, 0, 0, 0, 0, 0, 0}, 8);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (clip 1).arrays[0] (times and values)");
    add_clip(&list, 1, keys, 4);
    for (uint32_t channel = 1; channel <= 4; channel++)
        add_remove(&list, OBJECT_CHANNEL, channel);
    add_channel(&list, 9, 1, CHANNEL_NODE_SCALE, 1, 3, 1);
    expect_commit(scene, &list);
    assert_int_equal(scene->objects[OBJECT_CHANNEL].count, 1);
}

/* The number is beyond that of channels that are compared one by one. */
TEST(many_channels_with_equal_times_stay_distinct)
{
    enum { COUNT = 4 << 20, CHANNELS = 20, LEAP = COUNT - 3 };
    float *times = malloc(COUNT * sizeof(*times));
    assert_non_null(times);
    for (int i = 0; i < COUNT; i++)
        times[i] = (float)(i < LEAP ? i : i - LEAP);
    add_clip(&list, 2, times, COUNT);
    for (uint32_t i = 0; i < CHANNELS; i++)
        add_channel(&list, 10 + i, 2, CHANNEL_NODE_HIDDEN, 1, 1, LEAP)->value.first_value = 0;
    add_channel(&list, 50, 2, CHANNEL_NODE_HIDDEN, 1, 1, 3)->value.first_time = LEAP;
    expect_commit(scene, &list);
    times[LEAP] = LEAP;
    add_clip(&list, 2, times, COUNT);
    add_channel(&list, 51, 2, CHANNEL_NODE_HIDDEN, 1, 1, LEAP + 1)->value.first_value = 0;
    add_channel(&list, 50, 2, CHANNEL_NODE_HIDDEN, 1, 1, 2)->value.first_time = LEAP + 1;
    expect_commit(scene, &list);
    for (uint32_t i = 0; i < CHANNELS; i++)
        add_channel(&list, 10 + i, 2, CHANNEL_NODE_HIDDEN, 1, 1, LEAP + 1)->value.first_value = 0;
    add_channel(&list, 52, 2, CHANNEL_NODE_HIDDEN, 1, 1, 3)->value.first_time = LEAP - 1;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[20] (channel 52).first_time");
    free(times);
}

TEST(joints_of_a_mesh_have_their_places_in_its_skin)
{
    const uint16_t beyond[8] = {0, 1, 0, 1, 0, 2, 0, 1};
    add_skin(&list, 1, (uint32_t[]){2}, 1);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (skin 1).joint_count");
    add_joints(add_mesh(&list, 1), beyond, halves);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[7] (joints)");
    add_joints(add_mesh(&list, 2), beyond, halves);
    add_shown(&list, 4, NODE_MESH, 2)->value.skin = 1;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[1] (node 4).skin");
    /* A transaction with the skin, the mesh and the node is refused as well. */
    add_joints(add_mesh(&list, 1), beyond, halves);
    add_skin(&list, 1, (uint32_t[]){2, 1, 2}, 3);
    expect_commit(scene, &list);
    /* A mesh without joints may have a skin, which does nothing; and one with joints need not have one. */
    add_mesh(&list, 3);
    add_shown(&list, 4, NODE_MESH, 3)->value.skin = 1;
    add_shown(&list, 5, NODE_MESH, 1);
    expect_commit(scene, &list);
}

/* ---- removal ------------------------------------------------------------------------------------ */

TEST(what_changes_something_removed_goes_along)
{
    const struct hashmap *channels = &scene->objects[OBJECT_CHANNEL];
    add_remove(&list, OBJECT_LIGHT, 1);
    expect_commit(scene, &list);
    assert_null(hashmap_get(channels, 2));
    add_remove(&list, OBJECT_MATERIAL, 1);
    expect_commit(scene, &list);
    assert_null(hashmap_get(channels, 3));
    assert_int_equal(channels->count, 2);
    /* The joints go, node 2 with the one above it: so do the skin and channel 1, but not while node 3 needs it. */
    add_remove(&list, OBJECT_NODE, 1);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (node 1)");
    add_remove(&list, OBJECT_NODE, 2);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (node 2)");
    add_remove(&list, OBJECT_NODE, 1);
    add_shown(&list, 3, NODE_MESH, 1)->value.skin = 1;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (node 1)");
    add_remove(&list, OBJECT_NODE, 1);
    add_shown(&list, 3, NODE_MESH, 1);
    expect_commit(scene, &list);
    assert_int_equal(scene->objects[OBJECT_SKIN].count, 0);
    assert_int_equal(channels->count, 1);
    /* The clip takes the last channel along. */
    add_remove(&list, OBJECT_CLIP, 1);
    expect_commit(scene, &list);
    assert_int_equal(channels->count, 0);
    /* Nothing is counted that is not there any more. */
    add_remove(&list, OBJECT_NODE, 3);
    add_remove(&list, OBJECT_MESH, 1);
    expect_commit(scene, &list);
    assert_int_equal(scene->host_bytes, 0);
    assert_int_equal(scene->table_bytes, 0);
}

TEST(a_skin_in_use_is_not_removed)
{
    add_remove(&list, OBJECT_SKIN, 1);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (skin 1)");
    add_remove(&list, OBJECT_SKIN, 1);
    add_shown(&list, 3, NODE_MESH, 1)->value.skin = 1;
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[1] (node 3).skin");
    add_remove(&list, OBJECT_SKIN, 1);
    add_remove(&list, OBJECT_NODE, 3);
    expect_commit(scene, &list);
}

/* ---- accounts ----------------------------------------------------------------------------------- */

TEST_WITH(memory_of_what_moves_is_counted, begin_scene, end_scene)
{
    add_node(&list, 1, 0);
    add_mesh(&list, 1);
    expect_commit(scene, &list);
    uint64_t host_bytes = scene->host_bytes, table_bytes = scene->table_bytes;
    add_targets(add_joints(add_mesh(&list, 1), two_joints, halves), lifts, 2);
    expect_commit(scene, &list);
    assert_int_equal(scene->host_bytes - host_bytes, sizeof(two_joints) + sizeof(halves) + sizeof(lifts));
    assert_int_equal(scene->table_bytes, table_bytes);
    struct scene_node *node = add_node(&list, 1, 0);
    node->weights = make_weights((float[]){1, 2, 3}, 3);
    node->weight_count = 3;
    host_bytes = scene->host_bytes;
    expect_commit(scene, &list);
    assert_int_equal(scene->table_bytes - table_bytes, 12);
    assert_int_equal(scene->host_bytes - host_bytes, 12);
    host_bytes = scene->host_bytes, table_bytes = scene->table_bytes;
    add_skin(&list, 1, (uint32_t[]){1, 1}, 2);
    add_clip(&list, 1, keys, 8);
    expect_commit(scene, &list);
    uint64_t tables = scene->table_bytes - table_bytes;
    assert_true(tables > 0 && tables < 1000);
    assert_int_equal(scene->host_bytes - host_bytes, 8 + 32 + tables);
    /* Channels count with what their poses take, however few numbers they share. */
    table_bytes = scene->table_bytes;
    float many[1026] = {0, 1};
    add_clip(&list, 2, many, 1026);
    add_channel(&list, 1, 2, CHANNEL_NODE_WEIGHTS, 1, 1024, 1);
    expect_commit(scene, &list);
    assert_true(scene->table_bytes - table_bytes > 9 * 4096);
}

TEST(revisions_tell_what_moved)
{
    /* A joint is a node like any other, with nothing below it. */
    add_node(&list, 2, 1)->value.parent_from_node[3] = 5;
    expect_commit(scene, &list);
    assert_int_equal(scene->instances_revision, scene->revision);
    assert_true(scene->geometry_revision < scene->revision);
    struct scene_node *node = add_shown(&list, 3, NODE_MESH, 1);
    node->value.skin = 1;
    node->weights = make_weights((float[]){1}, 1);
    node->weight_count = 1;
    expect_commit(scene, &list);
    assert_int_equal(scene->instances_revision, scene->revision);
    add_skin(&list, 1, (uint32_t[]){2, 1}, 2);
    expect_commit(scene, &list);
    assert_int_equal(scene->instances_revision, scene->revision);
    add_targets(add_joints(add_mesh(&list, 1), two_joints, halves), lifts, 2);
    expect_commit(scene, &list);
    assert_int_equal(scene->geometry_revision, scene->revision);
    assert_int_equal(scene->instances_revision, scene->revision);
    /* Clips change nothing until a job plays them. */
    struct scene before = *scene;
    add_clip(&list, 1, keys, 8);
    add_channel(&list, 9, 1, CHANNEL_NODE_SCALE, 2, 3, 2);
    add_remove(&list, OBJECT_CHANNEL, 2);
    expect_commit(scene, &list);
    assert_int_equal(scene->geometry_revision, before.geometry_revision);
    assert_int_equal(scene->instances_revision, before.instances_revision);
    assert_int_equal(scene->shading_revision, before.shading_revision);
    assert_int_equal(scene->lights_revision, before.lights_revision);
}
