/* SPDX-License-Identifier: MIT */
/* Scenes in which things move while the shutter is open, and their poses: for the tests of tracers. */
#ifndef FARLIGHT_TESTS_MOTION_SCENES_H
#define FARLIGHT_TESTS_MOTION_SCENES_H

#include "tests/accuracy/test_scenes.h"

#include "scene/pose.h"

/* Poses that place nodes, in the order in which they are given: by ascending identifier. */
static inline void test_motion_init(struct scene_motion *motion, uint32_t pose_count)
{
    *motion = (struct scene_motion){.poses = calloc(pose_count, sizeof(*motion->poses)), .pose_count = pose_count};
}

static inline void test_pose_node(struct scene_pose *pose, uint32_t node, const float parent_from_node[12])
{
    pose->nodes = realloc(pose->nodes, (pose->node_count + 1) * sizeof(*pose->nodes));
    struct pose_node *posed = &pose->nodes[pose->node_count++];
    *posed = (struct pose_node){.node = node};
    memcpy(posed->parent_from_node, parent_from_node, sizeof(posed->parent_from_node));
}

static inline void test_pose_weights(struct scene_pose *pose, uint32_t node, const float *weights, uint32_t count)
{
    pose->morphs = realloc(pose->morphs, (pose->morph_count + 1) * sizeof(*pose->morphs));
    pose->weights = realloc(pose->weights, (pose->weight_count + count) * sizeof(*pose->weights));
    pose->morphs[pose->morph_count++] =
        (struct pose_weights){.node = node, .first = pose->weight_count, .count = count};
    memcpy(pose->weights + pose->weight_count, weights, count * sizeof(*weights));
    pose->weight_count += count;
}

/* A soup's instances (test_scene_soup): moved, turned while mirrored, scaled unevenly, and turned below a node
 * that moves. Node 4 has the group, 5 hangs below it. */
static inline void test_motion_of_soup(struct scene_motion *motion, uint32_t pose_count)
{
    test_motion_init(motion, pose_count);
    for (uint32_t p = 0; p < pose_count; p++) {
        float u = pose_count > 1 ? (float)p / (float)(pose_count - 1) : 0.0f, m[12];
        struct scene_pose *pose = &motion->poses[p];
        test_transform(m, 1, 1, 1, 1, 0, 0.8f * u, -0.3f * u, 0.5f * u * u);
        test_pose_node(pose, 1, m);
        test_transform(m, -1, 1, 1, 1, 0.7f + 0.9f * u, 2.5f, 0.2f * u, 0);
        test_pose_node(pose, 2, m);
        test_transform(m, 0.5f + 0.4f * u, 1.5f - 0.8f * u, 1, 2, -0.4f, 0, 2.5f, 0);
        test_pose_node(pose, 3, m);
        test_transform(m, 0.7f, 0.7f, 0.7f, 0, 1.1f - 0.6f * u, -2.5f - 0.4f * u, 0, 0);
        test_pose_node(pose, 4, m);
        test_transform(m, 1, 1, -1.2f, 1, 2.0f + 0.8f * u, 0, -1, 0.5f);
        test_pose_node(pose, 5, m);
    }
}

/* Turns and stretches nodes 2 and 3 of any scene; other nodes stand still. */
static inline void test_motion_of_two(struct scene_motion *motion, uint32_t pose_count)
{
    test_motion_init(motion, pose_count);
    for (uint32_t p = 0; p < pose_count; p++) {
        float u = pose_count > 1 ? (float)p / (float)(pose_count - 1) : 0.0f, m[12];
        struct scene_pose *pose = &motion->poses[p];
        test_transform(m, 1.3f - 0.5f * u, 0.6f + 0.3f * u, 0.9f, 0, 0.8f + 0.7f * u, 1.6f, 0.3f + 0.5f * u, 0);
        test_pose_node(pose, 2, m);
        test_transform(m, -0.5f, 0.5f + 0.4f * u, 0.5f, 1, 0.3f - 0.8f * u, -1.4f + 0.6f * u, 0, 0.3f * u);
        test_pose_node(pose, 3, m);
    }
}

#define TEST_JOINTS 3u
#define TEST_TARGETS 2u

/* Joints to a mesh that has been added: `count` a vertex, some without weight; its first vertices hang on none. */
static inline void test_add_joints(struct scene_mesh *mesh, uint32_t count, uint64_t seed)
{
    size_t total = (size_t)mesh->value.vertex_count * count;
    uint16_t *joints = malloc(total * sizeof(*joints));
    float *weights = malloc(total * sizeof(*weights));
    for (size_t i = 0; i < total; i++) {
        joints[i] = (uint16_t)(test_random(&seed) % TEST_JOINTS);
        weights[i] = i < 6 * count || test_random(&seed) % 4 == 0 ? 0.0f : test_uniform(&seed, 0.1f, 1.0f);
    }
    mesh->value.influence_count = count;
    mesh->arrays[MESH_JOINTS] = test_blob(joints, total * sizeof(*joints));
    mesh->arrays[MESH_WEIGHTS] = test_blob(weights, total * sizeof(*weights));
    free(joints);
    free(weights);
}

static inline struct blob *test_random_vectors(uint32_t count, float size, uint64_t seed)
{
    float *v = malloc((size_t)count * 3 * sizeof(*v));
    for (size_t i = 0; i < (size_t)count * 3; i++)
        v[i] = test_uniform(&seed, -size, size);
    struct blob *blob = test_blob(v, (size_t)count * 3 * sizeof(*v));
    free(v);
    return blob;
}

static inline void test_add_targets(struct scene_mesh *mesh, uint64_t seed)
{
    mesh->value.target_count = TEST_TARGETS;
    mesh->arrays[MESH_TARGET_POSITIONS] = test_random_vectors(mesh->value.vertex_count * TEST_TARGETS, 0.3f, seed);
    if (mesh->arrays[MESH_NORMALS])
        mesh->arrays[MESH_TARGET_NORMALS] =
            test_random_vectors(mesh->value.vertex_count * TEST_TARGETS, 0.3f, seed + 1);
    if (mesh->arrays[MESH_TANGENTS])
        mesh->arrays[MESH_TARGET_TANGENTS] =
            test_random_vectors(mesh->value.vertex_count * TEST_TARGETS, 0.3f, seed + 2);
    mesh->weights = malloc(TEST_TARGETS * sizeof(*mesh->weights));
    mesh->weights[0] = 0.5f;
    mesh->weights[1] = -0.25f;
    mesh->weight_count = TEST_TARGETS;
}

static inline void test_add_tangents(struct scene_mesh *mesh, uint64_t seed)
{
    float *v = malloc((size_t)mesh->value.vertex_count * 4 * sizeof(*v));
    for (size_t i = 0; i < mesh->value.vertex_count; i++) {
        for (size_t k = 0; k < 3; k++)
            v[4 * i + k] = test_uniform(&seed, -1, 1);
        v[4 * i + 3] = test_random(&seed) % 2 ? 1.0f : -1.0f;
    }
    mesh->arrays[MESH_TANGENTS] = test_blob(v, (size_t)mesh->value.vertex_count * 4 * sizeof(*v));
    free(v);
}

/* The mesh that test_soup_mesh() has just added to the transaction. */
static inline struct scene_mesh *test_last_mesh(struct test_edits *edits)
{
    return &edits->edits[edits->count - 1].set.mesh;
}

/* Joints are nodes 11, 12 below it, and 13; skin 30. */
static inline void test_add_skin(struct test_edits *edits)
{
    static const uint32_t nodes[TEST_JOINTS] = {11, 12, 13};
    float m[12], bind[TEST_JOINTS][12];
    test_transform(m, 1, 1, 1, 2, 0.3f, 0.2f, 0, 0);
    test_node(edits, 11, 0, NODE_GROUP, 0, m);
    test_transform(m, 1, 1.2f, 1, 0, -0.4f, 0, 0.5f, 0.1f);
    test_node(edits, 12, 11, NODE_GROUP, 0, m);
    test_transform(m, 0.8f, 0.8f, 0.8f, 1, 0.9f, -0.6f, 0, 0.3f);
    test_node(edits, 13, 0, NODE_GROUP, 0, m);
    for (uint32_t j = 0; j < TEST_JOINTS; j++)
        test_transform(bind[j], 1, 1, 1, (int)j, -0.2f * (float)(j + 1), 0.1f * (float)j, -0.1f, 0);
    struct scene_skin *skin = &test_add(edits, OBJECT_SKIN)->set.skin;
    skin->base.id = 30;
    skin->value.joint_count = TEST_JOINTS;
    skin->joints = test_blob(nodes, sizeof(nodes));
    skin->joint_from_mesh = test_blob(bind, sizeof(bind));
}

/* Meshes: one with tangents, joints and targets (10), shown twice, once below a node that its skin ignores;
 * one with targets alone (9), squeezed and mirrored; one with joints (8) that a node shows with its skin and
 * another without; a rigid one (7). */
static inline struct scene *test_scene_deformed(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    float m[12];
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    struct scene_material *cutout = test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    cutout->value.alpha_mode = ALPHA_MASK;
    test_add_skin(&edits);
    test_soup_mesh(&edits, 10, 40, 0.4f, 21);
    test_add_tangents(test_last_mesh(&edits), 51);
    test_add_joints(test_last_mesh(&edits), 4, 31);
    test_add_targets(test_last_mesh(&edits), 41);
    test_soup_mesh(&edits, 9, 40, 0.4f, 22);
    test_add_targets(test_last_mesh(&edits), 42);
    test_soup_mesh(&edits, 8, 30, 0.4f, 23);
    test_add_joints(test_last_mesh(&edits), 1, 33);
    test_soup_mesh(&edits, 7, 20, 0.4f, 24);
    test_node(&edits, 2, 0, NODE_MESH, 10, NULL)->value.skin = 30;
    test_transform(m, 3, 2, 1, 0, 1, 50, 60, 70);
    test_node(&edits, 3, 0, NODE_GROUP, 0, m);
    test_node(&edits, 4, 3, NODE_MESH, 8, NULL)->value.skin = 30;
    test_transform(m, 1.2f, -0.7f, 1, 1, 0.4f, 1.8f, 0.4f, 0);
    test_node(&edits, 5, 0, NODE_MESH, 9, m);
    test_transform(m, 1, 1, 1, 1, 0.4f, -2.0f, 0.4f, 0);
    test_node(&edits, 6, 0, NODE_MESH, 8, m);
    test_transform(m, 1, 1, 1, 1, 0.4f, 0, 2.2f, 0);
    test_node(&edits, 7, 0, NODE_MESH, 7, m);
    test_commit(&edits);
    return edits.scene;
}

/* The joints turn and targets come and go; node 5, whose mesh is morphed, moves as well. */
static inline void test_motion_of_deformed(struct scene_motion *motion, uint32_t pose_count)
{
    test_motion_init(motion, pose_count);
    for (uint32_t p = 0; p < pose_count; p++) {
        float u = pose_count > 1 ? (float)p / (float)(pose_count - 1) : 0.5f, m[12];
        float weights[TEST_TARGETS] = {1.0f - u, 0.8f * u};
        struct scene_pose *pose = &motion->poses[p];
        test_pose_weights(pose, 2, weights, TEST_TARGETS);
        test_transform(m, 1.2f, -0.7f - 0.2f * u, 1, 1, 0.4f + 0.5f * u, 1.8f, 0.4f - 0.6f * u, 0);
        test_pose_node(pose, 5, m);
        weights[1] = -0.5f;
        test_pose_weights(pose, 5, weights, TEST_TARGETS);
        test_transform(m, 1, 1, 1, 2, 0.3f + 0.7f * u, 0.2f, 0.3f * u, 0);
        test_pose_node(pose, 11, m);
        test_transform(m, 0.8f, 0.8f + 0.3f * u, 0.8f, 1, 0.9f - 0.8f * u, -0.6f, 0, 0.3f - 0.4f * u);
        test_pose_node(pose, 13, m);
    }
}

#endif
