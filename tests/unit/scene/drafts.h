/* SPDX-License-Identifier: MIT */
/* Transactions in the making, and what tests expect of them. */
#ifndef FARLIGHT_TESTS_SCENE_DRAFTS_H
#define FARLIGHT_TESTS_SCENE_DRAFTS_H

#include "scene/scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define EDITS_MAX 32

/* A transaction in the making. */
struct draft_list {
    struct scene_edit edits[EDITS_MAX];
    size_t count;
};

static inline struct scene_edit *add_set(struct draft_list *list, enum object_kind kind, uint32_t id)
{
    assert_true(list->count < EDITS_MAX);
    struct scene_edit *edit = &list->edits[list->count++];
    *edit = (struct scene_edit){.kind = EDIT_SET, .object = kind};
    edit->set.node.base.id = id;
    return edit;
}

static inline void add_remove(struct draft_list *list, enum object_kind kind, uint32_t id)
{
    assert_true(list->count < EDITS_MAX);
    list->edits[list->count++] = (struct scene_edit){.kind = EDIT_REMOVE, .object = kind, .id = id};
}

static inline struct scene_node *add_node(struct draft_list *list, uint32_t id, uint32_t parent)
{
    struct scene_node *node = &add_set(list, OBJECT_NODE, id)->set.node;
    node->value.parent = parent;
    node->value.parent_from_node[0] = node->value.parent_from_node[5] = node->value.parent_from_node[10] = 1.0f;
    return node;
}

static inline struct scene_node *add_shown(struct draft_list *list, uint32_t id, enum node_kind kind,
                                           uint32_t object)
{
    struct scene_node *node = add_node(list, id, 0);
    node->value.kind = kind;
    node->value.object = object;
    return node;
}

static inline struct blob *make_blob(const void *data, size_t bytes)
{
    struct blob *blob = blob_create(bytes);
    assert_non_null(blob);
    memcpy(blob->data, data, bytes);
    return blob;
}

static const float square[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
static const uint32_t square_indices[6] = {0, 1, 2, 0, 2, 3};

/* Two triangles. */
static inline struct scene_mesh *add_mesh(struct draft_list *list, uint32_t id)
{
    struct scene_mesh *mesh = &add_set(list, OBJECT_MESH, id)->set.mesh;
    mesh->value.vertex_count = 4;
    mesh->value.triangle_count = 2;
    mesh->arrays[MESH_POSITIONS] = make_blob(square, sizeof(square));
    mesh->arrays[MESH_INDICES] = make_blob(square_indices, sizeof(square_indices));
    return mesh;
}

static inline void add_range(struct scene_mesh *mesh, uint32_t first, uint32_t count, uint32_t material)
{
    mesh->ranges = realloc(mesh->ranges, (mesh->range_count + 1) * sizeof(*mesh->ranges));
    assert_non_null(mesh->ranges);
    mesh->ranges[mesh->range_count++] = (struct record_material_range){first, count, material};
}

static inline struct scene_spheres *add_spheres(struct draft_list *list, uint32_t id, const float *numbers,
                                                uint32_t count)
{
    struct scene_spheres *spheres = &add_set(list, OBJECT_SPHERES, id)->set.spheres;
    spheres->value.sphere_count = count;
    spheres->centres_radii = make_blob(numbers, count * 16);
    return spheres;
}

static inline void finish(struct draft_list *list)
{
    for (size_t i = 0; i < list->count; i++)
        scene_edit_finish(&list->edits[i]);
    list->count = 0;
}

static inline void expect_commit(struct scene *scene, struct draft_list *list)
{
    struct error error = {0};
    uint64_t before = scene->revision;
    if (!scene_commit(scene, list->edits, list->count, &error))
        fail_msg("%s: %s", error.field, error.text);
    assert_int_equal(scene->revision, before + 1);
    finish(list);
}

/* State that a refused transaction may not change. */
struct snapshot {
    struct scene scene;
    size_t counts[OBJECT_COUNT];
};

static inline struct snapshot snapshot_of(const struct scene *scene)
{
    struct snapshot snapshot = {.scene = *scene};
    for (int kind = 0; kind < OBJECT_COUNT; kind++)
        snapshot.counts[kind] = scene->objects[kind].count;
    return snapshot;
}

static inline void expect_refusal(struct scene *scene, struct draft_list *list, enum error_code kind,
                                  const char *field)
{
    struct error error = {0};
    struct snapshot before = snapshot_of(scene);
    if (scene_commit(scene, list->edits, list->count, &error))
        fail_msg("accepted, but an error at %s was expected", field);
    assert_string_equal(error.field, field);
    if (error.kind != kind)
        fail_msg("error kind %d, expected %d (%s)", error.kind, kind, error.text);
    assert_true(strlen(error.text) > 0);
    struct snapshot after = snapshot_of(scene);
    assert_memory_equal(before.counts, after.counts, sizeof(before.counts));
    assert_int_equal(after.scene.revision, before.scene.revision);
    assert_int_equal(after.scene.host_bytes, before.scene.host_bytes);
    assert_int_equal(after.scene.geometry_revision, before.scene.geometry_revision);
    assert_int_equal(after.scene.instances_revision, before.scene.instances_revision);
    finish(list);
}

static inline struct scene *new_scene(void)
{
    struct scene *scene = scene_create("test", NULL);
    assert_non_null(scene);
    return scene;
}

/* ---- what moves ---------------------------------------------------------------------------------- */

static inline struct scene_skin *add_skin(struct draft_list *list, uint32_t id, const uint32_t *joints,
                                          uint32_t count)
{
    struct scene_skin *skin = &add_set(list, OBJECT_SKIN, id)->set.skin;
    skin->value.joint_count = count;
    skin->joints = make_blob(joints, count * sizeof(*joints));
    return skin;
}

static inline struct scene_clip *add_clip(struct draft_list *list, uint32_t id, const float *floats, size_t count)
{
    struct scene_clip *clip = &add_set(list, OBJECT_CLIP, id)->set.clip;
    clip->floats = make_blob(floats, count * sizeof(*floats));
    return clip;
}

/* Times from the start of the clip's array, values behind them. */
static inline struct scene_channel *add_channel(struct draft_list *list, uint32_t id, uint32_t clip,
                                                enum channel_path path, uint32_t object, uint32_t width,
                                                uint32_t key_count)
{
    struct scene_channel *channel = &add_set(list, OBJECT_CHANNEL, id)->set.channel;
    channel->value.clip = clip;
    channel->value.path = path;
    channel->value.object = object;
    channel->value.interpolation = INTERPOLATION_LINEAR;
    channel->value.width = width;
    channel->value.key_count = key_count;
    channel->value.first_value = key_count;
    return channel;
}

/* Both joints move each vertex of the square of add_mesh(), as much as the weights say. */
static inline struct scene_mesh *add_joints(struct scene_mesh *mesh, const uint16_t joints[8],
                                            const float weights[8])
{
    mesh->value.influence_count = 2;
    mesh->arrays[MESH_JOINTS] = make_blob(joints, 8 * sizeof(*joints));
    mesh->arrays[MESH_WEIGHTS] = make_blob(weights, 8 * sizeof(*weights));
    return mesh;
}

/* Morph targets of the same square. */
static inline struct scene_mesh *add_targets(struct scene_mesh *mesh, const float *positions, uint32_t count)
{
    mesh->value.target_count = count;
    mesh->arrays[MESH_TARGET_POSITIONS] = make_blob(positions, count * sizeof(square));
    return mesh;
}

static inline float *make_weights(const float *weights, uint32_t count)
{
    float *copy = malloc(count * sizeof(*copy));
    assert_non_null(copy);
    memcpy(copy, weights, count * sizeof(*copy));
    return copy;
}

#endif
