/* SPDX-License-Identifier: MIT */
/* Skins and morph targets on the CPU, and the bounds of what they make. */
#include "tests/unit/scene/scene_fixture.h"

#include "scene/pose.h"

#define PI 3.14159265358979323846

EACH_TEST(begin_scene, end_scene)

static void deform(const struct scene_pose *pose, uint32_t node, float positions[12], float *normals)
{
    struct error error = {0};
    if (!scene_deform(scene, pose, scene_node(scene, node), positions, normals, &error))
        fail_msg("%s: %s", error.field, error.text);
}

static const uint16_t both[8] = {0, 1, 0, 1, 0, 1, 0, 1};
static const float up_normals[12] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};

TEST(a_vertex_is_the_mean_of_where_its_joints_put_it)
{
    /* Joint 1 moves by 10 along x; joint 2 below it turns a quarter about z. */
    add_node(&list, 1, 0)->value.parent_from_node[3] = 10;
    const float quarter[12] = {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0};
    memcpy(add_node(&list, 2, 1)->value.parent_from_node, quarter, sizeof(quarter));
    /* Weights of vertex 0: none; 1: the first alone; 2: a quarter and three, of a sum of 8; 3: the second alone.
     */
    const float weights[8] = {0, 0, 5, 0, 2, 6, 0, 0.125f};
    add_joints(add_mesh(&list, 1), both, weights);
    struct scene_node *node = add_shown(&list, 3, NODE_MESH, 1);
    node->value.skin = 1;
    node->value.parent_from_node[3] = 1e6f; /* not looked at */
    struct scene_skin *skin = add_skin(&list, 1, (uint32_t[]){1, 2}, 2);
    /* The second joint's own place in the mesh is at 1 0 0. */
    const float inverse_binds[24] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, -1, 0, 1, 0, 0, 0, 0, 1, 0};
    skin->joint_from_mesh = make_blob(inverse_binds, sizeof(inverse_binds));
    expect_commit(scene, &list);
    float positions[12];
    deform(NULL, 3, positions, NULL);
    /* The square is 000, 100, 110, 010. Joint 1 takes 110 to 11 1 0, joint 2 takes it to 0 1 0, then to -1 0 0,
     * then to 9 0 0; 010 to -1 1 0, to -1 -1 0, to 9 -1 0. */
    const double expected[12] = {0, 0, 0, 11, 0, 0, 9 + 0.25 * 2, 0.25, 0, 9, -1, 0};
    expect_near("skinned", positions, expected, 12, 1e-6);
    /* Its bounds in the scene are those of its vertices. */
    float lower[3], upper[3];
    assert_true(scene_bounds(scene, NULL, lower, upper));
    expect_near("lower", lower, (double[]){0, -1, 0}, 3, 1e-6);
    expect_near("upper", upper, (double[]){11, 0.25, 0}, 3, 1e-6);
    struct scene_instance *instances;
    size_t count;
    assert_true(scene_flatten(scene, NULL, NODE_MESH, &instances, &count));
    assert_int_equal(count, 1);
    const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    assert_memory_equal(instances[0].world_from_object, identity, sizeof(identity));
    assert_memory_equal(instances[0].object_from_world, identity, sizeof(identity));
    free(instances);
}

TEST(joints_below_joints_follow_a_clip)
{
    /* Joints at the origin and, 1 along x below it; each turns by a right angle about z in a second. */
    add_node(&list, 1, 0);
    add_node(&list, 2, 1)->value.parent_from_node[3] = 1;
    const float weights[8] = {1, 0, 1, 0, 0, 1, 0, 1};
    add_joints(add_mesh(&list, 1), both, weights);
    add_shown(&list, 3, NODE_MESH, 1)->value.skin = 1;
    struct scene_skin *skin = add_skin(&list, 1, (uint32_t[]){1, 2}, 2);
    const float inverse_binds[24] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, -1, 0, 1, 0, 0, 0, 0, 1, 0};
    skin->joint_from_mesh = make_blob(inverse_binds, sizeof(inverse_binds));
    add_clip(&list, 1, (float[]){0, 1, 0, 0, 0, 1, 0, 0, 0.70710678f, 0.70710678f}, 10);
    add_channel(&list, 1, 1, CHANNEL_NODE_ROTATION, 1, 4, 2);
    add_channel(&list, 2, 1, CHANNEL_NODE_ROTATION, 2, 4, 2);
    expect_commit(scene, &list);
    for (double t = 0; t <= 1; t += 0.125) {
        struct scene_pose pose;
        const struct record_clip_use use = {.clip = 1, .speed = 1};
        assert_true(scene_pose_evaluate(&pose, scene, &use, 1, t, NULL));
        float positions[12];
        deform(&pose, 3, positions, NULL);
        double a = t * PI / 2, c = cos(a), s = sin(a);
        /* 110 is 0 1 0 seen from the second joint, which turns by twice as much; 010 is -1 1 0. */
        const double expected[12] = {0,
                                     0,
                                     0,
                                     c,
                                     s,
                                     0,
                                     c - sin(2 * a),
                                     s + cos(2 * a),
                                     0,
                                     c - cos(2 * a) - sin(2 * a),
                                     s - sin(2 * a) + cos(2 * a),
                                     0};
        expect_near("bent", positions, expected, 12, 1e-6);
        scene_pose_finish(&pose);
    }
}

TEST(targets_are_added_before_joints_move)
{
    const float doubled[12] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0};
    memcpy(add_node(&list, 1, 0)->value.parent_from_node, doubled, sizeof(doubled));
    const float weights[8] = {1, 0, 1, 0, 1, 0, 1, 0};
    const float targets[24] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    add_targets(add_joints(add_mesh(&list, 1), both, weights), targets, 2);
    add_skin(&list, 1, (uint32_t[]){1, 1}, 2);
    for (uint32_t id = 2; id <= 3; id++) {
        struct scene_node *node = add_shown(&list, id, NODE_MESH, 1);
        node->weights = make_weights((float[]){0.5f, -1}, 2);
        node->weight_count = 2;
        node->value.skin = id == 3;
        node->value.parent_from_node[3] = 100;
    }
    expect_commit(scene, &list);
    const double morphed[12] = {-3, 0, 0.5, 1, 0, 0.5, 1, 1, 0.5, 0, 1, 0.5};
    double skinned[12];
    for (int i = 0; i < 12; i++)
        skinned[i] = 2 * morphed[i];
    float positions[12];
    deform(NULL, 2, positions, NULL);
    expect_near("morphed, in the node's space", positions, morphed, 12, 1e-6);
    deform(NULL, 3, positions, NULL);
    expect_near("morphed and skinned, in the world's", positions, skinned, 12, 1e-6);
    float lower[3], upper[3];
    assert_true(scene_bounds(scene, NULL, lower, upper));
    expect_near("lower", lower, (double[]){-6, 0, 0.5}, 3, 1e-6);
    expect_near("upper", upper, (double[]){101, 2, 1}, 3, 1e-6);
    /* A mesh that nothing deforms is as it is given. */
    add_mesh(&list, 1);
    add_shown(&list, 2, NODE_MESH, 1);
    add_remove(&list, OBJECT_NODE, 3);
    expect_commit(scene, &list);
    assert_false(scene_node_deforms(scene_node(scene, 2), scene_mesh(scene, 1)));
    deform(NULL, 2, positions, NULL);
    assert_memory_equal(positions, square, sizeof(square));
}

/* Normals stay at right angles to the surface and on the same side, under any matrix. */
TEST(normals_follow_scaled_sheared_and_mirrored_joints)
{
    const float matrices[][12] = {
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
        {3, 0, 0, 5, 0, 0.5f, 0, 5, 0, 0, 2, 5},
        {1, 0, 0.5f, 0, 0.25f, 1, -1, 0, 0.5f, 0, 2, 0},
        {-2, 0, 0, 0, 0, 1, 0.5f, 0, 0.75f, 0, 1, 0},
        {1, 0, 0, 0, 0, 1, 0, 0, 0.5f, -0.25f, -1, 0},
    };
    for (size_t i = 0; i < sizeof(matrices) / sizeof(matrices[0]); i++) {
        memcpy(add_node(&list, 1, 0)->value.parent_from_node, matrices[i], sizeof(matrices[i]));
        const float weights[8] = {1, 0, 1, 0, 1, 0, 1, 0};
        struct scene_mesh *mesh = add_joints(add_mesh(&list, 1), both, weights);
        mesh->arrays[MESH_NORMALS] = make_blob(up_normals, sizeof(up_normals));
        add_skin(&list, 1, (uint32_t[]){1, 1}, 2);
        add_shown(&list, 2, NODE_MESH, 1)->value.skin = 1;
        expect_commit(scene, &list);
        float p[12], n[12];
        deform(NULL, 2, p, n);
        for (int v = 0; v < 4; v++) {
            double along_x = 0, along_y = 0, side = 0, length = 0;
            for (int k = 0; k < 3; k++) {
                along_x += (double)((p[3 + k] - p[k]) * n[3 * v + k]);
                along_y += (double)((p[9 + k] - p[k]) * n[3 * v + k]);
                side += (double)(matrices[i][4 * k + 2] * n[3 * v + k]); /* side to which +z goes */
                length += (double)(n[3 * v + k] * n[3 * v + k]);
            }
            if (!(fabs(along_x) < 1e-6 && fabs(along_y) < 1e-6 && side > 0 && fabs(length - 1) < 1e-6))
                fail_msg("matrix %zu, vertex %d: %g %g %g %g", i, v, along_x, along_y, side, length);
        }
    }
}

TEST(morphed_normals_are_given_along)
{
    const float targets[12] = {0}, tilts[12] = {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    struct scene_mesh *mesh = add_targets(add_mesh(&list, 1), targets, 1);
    mesh->arrays[MESH_NORMALS] = make_blob(up_normals, sizeof(up_normals));
    mesh->arrays[MESH_TARGET_NORMALS] = make_blob(tilts, sizeof(tilts));
    mesh->weights = make_weights((float[]){1}, 1);
    mesh->weight_count = 1;
    add_shown(&list, 2, NODE_MESH, 1);
    expect_commit(scene, &list);
    float p[12], n[12];
    deform(NULL, 2, p, n);
    const double half = sqrt(0.5), expected[12] = {half, 0, half, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    expect_near("normals", n, expected, 12, 1e-6);
}

TEST(vertices_that_leave_the_floats_are_no_part_of_the_bounds)
{
    /* Four scales by 1e12, one below the other. */
    for (uint32_t id = 1; id <= 4; id++) {
        struct scene_node *node = add_node(&list, id, id - 1);
        node->value.parent_from_node[0] = node->value.parent_from_node[5] = node->value.parent_from_node[10] =
            1e12f;
    }
    add_node(&list, 5, 0);
    const float weights[8] = {1, 0, 1, 0, 1, 0, 0, 1};
    add_joints(add_mesh(&list, 1), both, weights);
    add_skin(&list, 1, (uint32_t[]){5, 4}, 2);
    add_shown(&list, 6, NODE_MESH, 1)->value.skin = 1;
    expect_commit(scene, &list);
    float lower[3], upper[3];
    assert_true(scene_bounds(scene, NULL, lower, upper));
    expect_near("lower", lower, (double[]){0, 0, 0}, 3, 0);
    expect_near("upper", upper, (double[]){1, 1, 0}, 3, 0);
}
