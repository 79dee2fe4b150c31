/* SPDX-License-Identifier: MIT */
/* Flattening of the hierarchy, against a straightforward recursion. */
#include "scene/affine.h"
#include "scene/scene.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NODES 400

static uint32_t random_state = 1;

/* Numerical Recipes' quick generator: the same numbers on every machine. */
static uint32_t random_number(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return random_state >> 8;
}

static float random_float(void)
{
    return (float)(random_number() % 2001) / 1000.0f - 1.0f;
}

static void commit(struct scene *scene, struct scene_edit *edits, size_t count)
{
    struct error error = {0};
    if (!scene_commit(scene, edits, count, &error))
        fail_msg("%s: %s", error.field, error.text);
}

/* A camera 1, which needs no arrays, so that nodes have something to show. */
static struct scene *scene_with_camera(void)
{
    struct scene *scene = scene_create("test", NULL);
    assert_non_null(scene);
    struct scene_edit edit = {.kind = EDIT_SET, .object = OBJECT_CAMERA};
    edit.set.camera.base.id = 1;
    edit.set.camera.value.fov_y = 1;
    commit(scene, &edit, 1);
    return scene;
}

static struct scene_edit node_edit(uint32_t id, uint32_t parent, enum node_kind kind, const float m[12])
{
    struct scene_edit edit = {.kind = EDIT_SET, .object = OBJECT_NODE};
    edit.set.node.base.id = id;
    edit.set.node.value.parent = parent;
    edit.set.node.value.kind = kind;
    edit.set.node.value.object = kind == NODE_GROUP ? 0 : 1;
    memcpy(edit.set.node.value.parent_from_node, m, 12 * sizeof(*m));
    return edit;
}

/* The plain recursion. False: hidden. */
static bool plain_world(const struct scene *scene, uint32_t id, double world[12])
{
    const struct scene_node *node = scene_node(scene, id);
    double above[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    bool visible = !node->value.hidden;
    if (node->value.parent)
        visible = plain_world(scene, node->value.parent, above) && visible;
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 4; column++) {
            double sum = column == 3 ? above[4 * row + 3] : 0;
            for (int i = 0; i < 3; i++)
                sum += above[4 * row + i] * (double)node->value.parent_from_node[4 * i + column];
            world[4 * row + column] = sum;
        }
    }
    return visible;
}

static void expect_matrix(const float got[12], const double expected[12], uint32_t id)
{
    double scale = 0;
    for (int i = 0; i < 12; i++)
        scale = fmax(scale, fabs(expected[i]));
    for (int i = 0; i < 12; i++) {
        if (!(fabs((double)got[i] - expected[i]) <= 1e-6 * scale))
            fail_msg("node %u: entry %d is %.9g, expected %.9g", id, i, (double)got[i], expected[i]);
    }
}

TEST(instances_agree_with_the_plain_recursion_in_the_order_of_ids)
{
    struct scene *scene = scene_with_camera();
    struct scene_edit *edits = calloc(NODES, sizeof(*edits));
    assert_non_null(edits);
    uint32_t ids[NODES];
    for (uint32_t i = 0; i < NODES; i++) {
        /* Scattered ids, neither ascending nor dense; every parent is one of those before. */
        ids[i] = i * 7919 % 10007 + 1;
        uint32_t parent = i < 5 ? 0 : ids[random_number() % i];
        float m[12];
        for (int k = 0; k < 12; k++)
            m[k] = random_float();
        edits[i] = node_edit(ids[i], parent, random_number() % 3 ? NODE_CAMERA : NODE_GROUP, m);
        edits[i].set.node.value.hidden = random_number() % 10 == 0;
    }
    commit(scene, edits, NODES);
    free(edits);
    struct scene_instance *instances;
    size_t count, expected_count = 0, mirrored = 0;
    assert_true(scene_flatten(scene, NULL, NODE_CAMERA, &instances, &count));
    for (uint32_t i = 0; i < NODES; i++) {
        double world[12];
        bool visible = plain_world(scene, ids[i], world);
        expected_count += visible && scene_node(scene, ids[i])->value.kind == NODE_CAMERA;
        float got[12];
        assert_true(scene_world_from_node(scene, NULL, ids[i], got));
        expect_matrix(got, world, ids[i]);
    }
    assert_int_equal(count, expected_count);
    assert_true(count > 50 && count < NODES);
    for (size_t i = 0; i < count; i++) {
        uint32_t id = instances[i].node->base.id;
        assert_true(i == 0 || instances[i - 1].node->base.id < id);
        double world[12];
        assert_true(plain_world(scene, id, world));
        expect_matrix(instances[i].world_from_object, world, id);
        const float *m = instances[i].world_from_object;
        mirrored += m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                        m[2] * (m[4] * m[9] - m[5] * m[8]) <
                    0;
        if (instances[i].singular)
            continue;
        /* A point there and back. */
        float point[3] = {0.3f, -0.7f, 0.2f}, back[3];
        affine_point(back, instances[i].world_from_object, point);
        affine_point(back, instances[i].object_from_world, back);
        float size = 1;
        for (int k = 0; k < 12; k++)
            size = fmaxf(size, fabsf(instances[i].object_from_world[k]));
        for (int k = 0; k < 3; k++)
            assert_true(fabsf(back[k] - point[k]) < 1e-5f * size);
    }
    assert_true(mirrored > 10);
    free(instances);
    scene_destroy(scene);
}

TEST(a_hidden_node_hides_everything_below)
{
    struct scene *scene = scene_with_camera();
    const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    struct scene_edit edits[] = {
        node_edit(1, 0, NODE_GROUP, identity),
        node_edit(2, 1, NODE_CAMERA, identity),
        node_edit(3, 2, NODE_CAMERA, identity),
        node_edit(4, 0, NODE_CAMERA, identity),
    };
    edits[0].set.node.value.hidden = true;
    commit(scene, edits, 4);
    struct scene_instance *instances;
    size_t count;
    assert_true(scene_flatten(scene, NULL, NODE_CAMERA, &instances, &count));
    assert_int_equal(count, 1);
    assert_int_equal(instances[0].node->base.id, 4);
    free(instances);
    assert_true(scene_flatten(scene, NULL, NODE_LIGHT, &instances, &count));
    assert_int_equal(count, 0);
    assert_null(instances);
    float world[12];
    assert_true(scene_world_from_node(scene, NULL, 3, world));
    assert_false(scene_world_from_node(scene, NULL, 9, world));
    scene_destroy(scene);
}

TEST(flattening_and_overflowing_transforms_are_marked)
{
    struct scene *scene = scene_with_camera();
    const float flat[12] = {1, 0, 0, 5, 0, 0, 0, 6, 0, 0, 1, 7},
                large[12] = {1e12f, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    struct scene_edit edits[] = {
        node_edit(1, 0, NODE_CAMERA, flat),  node_edit(2, 0, NODE_CAMERA, large),
        node_edit(3, 2, NODE_CAMERA, large), node_edit(4, 3, NODE_CAMERA, large),
        node_edit(5, 4, NODE_CAMERA, large),
    };
    commit(scene, edits, 5);
    struct scene_instance *instances;
    size_t count;
    assert_true(scene_flatten(scene, NULL, NODE_CAMERA, &instances, &count));
    assert_int_equal(count, 5);
    const bool singular[] = {true, false, false, false, true}; /* 1e48 is beyond a float */
    for (size_t i = 0; i < 5; i++) {
        if (instances[i].singular != singular[i])
            fail_msg("node %zu: singular is %d", i + 1, instances[i].singular);
        for (int k = 0; k < 12; k++) {
            assert_true(isfinite(instances[i].world_from_object[k]));
            assert_true(!singular[i] || instances[i].object_from_world[k] == 0.0f);
        }
    }
    assert_true(instances[0].world_from_object[3] == 5.0f);
    free(instances);
    scene_destroy(scene);
}

TEST(the_bounds_are_those_of_visible_geometry_and_discs_stand_in)
{
    struct scene *scene = scene_with_camera();
    float lower[3], upper[3];
    assert_false(scene_bounds(scene, NULL, lower, upper));
    struct scene_edit disc = {.kind = EDIT_SET, .object = OBJECT_DISC};
    disc.set.disc.base.id = 1;
    disc.set.disc.value.normal_world[1] = 1;
    disc.set.disc.value.radius = 9;
    commit(scene, &disc, 1);
    assert_true(scene_bounds(scene, NULL, lower, upper));
    assert_memory_equal(lower, ((float[]){-9, 0, -9}), 12);
    assert_memory_equal(upper, ((float[]){9, 0, 9}), 12);
    const float moved[12] = {0, -2, 0, 10, 2, 0, 0, 0, 0, 0, 2, 0},
                far_away[12] = {1, 0, 0, 1e6f, 0, 1, 0, 0, 0, 0, 1, 0};
    struct scene_edit edits[] = {
        {.kind = EDIT_SET, .object = OBJECT_SPHERES},
        node_edit(1, 0, NODE_SPHERES, moved),
        node_edit(2, 0, NODE_SPHERES, far_away),
    };
    edits[0].set.spheres.base.id = 1;
    edits[0].set.spheres.value.sphere_count = 1;
    edits[0].set.spheres.centres_radii = blob_create(16);
    memcpy(edits[0].set.spheres.centres_radii->data, ((float[]){3, 0, 0, 1}), 16);
    edits[2].set.node.value.hidden = true;
    commit(scene, edits, 3);
    assert_true(scene_bounds(scene, NULL, lower, upper));
    assert_memory_equal(lower, ((float[]){8, 4, -2}), 12);
    assert_memory_equal(upper, ((float[]){12, 8, 2}), 12);
    scene_destroy(scene);
}
