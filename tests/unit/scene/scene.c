/* SPDX-License-Identifier: MIT */
/* Transactions: what they refuse, that they then change nothing, and what they note about a change. */
#include "tests/unit/scene/scene_fixture.h"

#include "base/clock.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void begin_with(const struct scene_limits *limits)
{
    scene_destroy(scene);
    scene = scene_create("limited", limits);
}

EACH_TEST(begin_scene, end_scene)

/* ---- order and references ----------------------------------------------------------------------- */

TEST(an_edit_may_refer_to_what_a_later_one_makes)
{
    add_node(&list, 3, 2);
    add_shown(&list, 2, NODE_MESH, 7);
    add_range(add_mesh(&list, 7), 0, 2, 5);
    add_set(&list, OBJECT_MATERIAL, 5)->set.material.textures[MATERIAL_BASE_COLOUR].texture = 9;
    struct scene_texture *texture = &add_set(&list, OBJECT_TEXTURE, 9)->set.texture;
    texture->value.width = texture->value.height = 1;
    texture->texels = make_blob("\1\2\3\4", 4);
    expect_commit(scene, &list);
    assert_int_equal(scene_node(scene, 3)->value.parent, 2);
    assert_int_equal(scene_node(scene, 2)->child_count, 1);
    assert_int_equal(scene_mesh(scene, 7)->ranges[0].material, 5);
    assert_int_equal(scene_mesh(scene, 7)->base.revision, 1);
    assert_non_null(scene_texture(scene, 9)->texels);
    assert_true(scene->host_bytes > sizeof(square) + sizeof(square_indices));
}

TEST(the_last_edit_of_an_object_counts)
{
    add_mesh(&list, 1);
    add_mesh(&list, 1);
    add_mesh(&list, 2);
    add_remove(&list, OBJECT_MESH, 2);
    expect_commit(scene, &list);
    assert_int_equal(scene->objects[OBJECT_MESH].count, 1);
    uint64_t one_mesh = scene->host_bytes;
    add_remove(&list, OBJECT_MESH, 1);
    add_mesh(&list, 1);
    expect_commit(scene, &list);
    assert_int_equal(scene->objects[OBJECT_MESH].count, 1);
    assert_int_equal(scene_mesh(scene, 1)->base.revision, 2);
    assert_int_equal(scene->host_bytes, one_mesh);
    add_remove(&list, OBJECT_MESH, 1);
    expect_commit(scene, &list);
    assert_int_equal(scene->host_bytes, 0);
}

TEST(references_to_nothing_are_refused_and_named)
{
    add_shown(&list, 1, NODE_MESH, 4);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (node 1).object");
    add_shown(&list, 1, NODE_LIGHT, 0);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (node 1).object");
    add_mesh(&list, 4);
    add_shown(&list, 1, NODE_SPHERES, 4); /* the right number, the wrong kind */
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[1] (node 1).object");
    add_shown(&list, 1, NODE_GROUP, 4);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (node 1).object");
    struct scene_mesh *mesh = add_mesh(&list, 3);
    add_range(mesh, 0, 1, 0);
    add_range(mesh, 1, 1, 8);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (mesh 3).ranges[1].material");
    add_set(&list, OBJECT_MATERIAL, 6)->set.material.textures[MATERIAL_NORMAL].texture = 2;
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (material 6).textures[1].texture");
    struct scene_disc *disc = &add_set(&list, OBJECT_DISC, 1)->set.disc;
    disc->value.material = 5;
    disc->value.normal_world[1] = disc->value.radius = 1;
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (disc 1).material");
    add_node(&list, 0, 0);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (node 0)");
}

TEST(what_is_in_use_is_not_removed)
{
    add_shown(&list, 1, NODE_MESH, 7);
    add_range(add_mesh(&list, 7), 0, 2, 5);
    add_set(&list, OBJECT_MATERIAL, 5)->set.material.textures[MATERIAL_BUMP].texture = 9;
    struct scene_texture *texture = &add_set(&list, OBJECT_TEXTURE, 9)->set.texture;
    texture->value.width = texture->value.height = 1;
    texture->texels = make_blob("\1\2\3\4", 4);
    add_set(&list, OBJECT_MATERIAL, 6);
    struct scene_disc *disc = &add_set(&list, OBJECT_DISC, 3)->set.disc;
    disc->value.normal_world[1] = disc->value.radius = 1.0f;
    disc->value.material = 6;
    expect_commit(scene, &list);
    add_remove(&list, OBJECT_MESH, 7);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 7)");
    add_remove(&list, OBJECT_MATERIAL, 5);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (material 5)");
    add_remove(&list, OBJECT_MATERIAL, 6);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (material 6)");
    add_remove(&list, OBJECT_TEXTURE, 9);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (texture 9)");
    add_remove(&list, OBJECT_LIGHT, 1);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (light 1)");
    /* Everything together goes, in any order. */
    add_remove(&list, OBJECT_TEXTURE, 9);
    add_remove(&list, OBJECT_MESH, 7);
    add_remove(&list, OBJECT_NODE, 1);
    add_remove(&list, OBJECT_MATERIAL, 5);
    add_remove(&list, OBJECT_MATERIAL, 6);
    add_remove(&list, OBJECT_DISC, 3);
    expect_commit(scene, &list);
    assert_int_equal(scene->host_bytes, 0);
}

TEST(a_refused_transaction_leaves_its_blobs_with_the_edits)
{
    struct blob *positions = blob_ref(add_mesh(&list, 1)->arrays[MESH_POSITIONS]);
    add_shown(&list, 1, NODE_CAMERA, 1);
    struct error error = {0};
    assert_false(scene_commit(scene, list.edits, list.count, &error));
    assert_int_equal(atomic_load(&positions->references), 2);
    finish(&list);
    assert_int_equal(atomic_load(&positions->references), 1);
    blob_unref(positions);
}

/* ---- contents ----------------------------------------------------------------------------------- */

TEST(arrays_must_fit_their_counts)
{
    add_mesh(&list, 1)->value.vertex_count = 5;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[0] (positions)");
    add_mesh(&list, 1)->value.triangle_count = 1;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[1] (indices)");
    add_mesh(&list, 1)->value.triangle_count = 0x55555556; /* 3 of it wrap to 2 in 32 bits */
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[1] (indices)");
    struct scene_mesh *mesh = add_mesh(&list, 1);
    blob_unref(mesh->arrays[MESH_INDICES]);
    mesh->arrays[MESH_INDICES] = NULL;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[1] (indices)");
    add_mesh(&list, 1)->arrays[MESH_COLOURS] = make_blob(square, 15);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[6] (colours)");
    add_mesh(&list, 1)->arrays[MESH_COLOURS] = make_blob(square, 31); /* 16 bits an element, and 32 are needed */
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[6] (colours)");
    add_mesh(&list, 1)->arrays[MESH_TANGENTS] = make_blob(square, 48);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[3] (tangents)");
    add_mesh(&list, 1)->value.vertex_count = 0;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).vertex_count");
    add_spheres(&list, 2, square, 3)->value.sphere_count = 2;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (spheres 2).arrays[0] (centres and radii)");
    struct scene_texture *texture = &add_set(&list, OBJECT_TEXTURE, 9)->set.texture;
    texture->value.width = texture->value.height = 65536; /* wraps to 0 in 32 bits */
    texture->texels = make_blob(square, 4);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (texture 9).arrays[0] (texels)");
}

TEST(numbers_that_are_no_place_are_refused)
{
    const float bad[] = {NAN, INFINITY, -INFINITY, 2e18f, -2e18f};
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
        for (size_t place = 0; place < 12; place += 11) {
            float *positions = (float *)(void *)add_mesh(&list, 1)->arrays[MESH_POSITIONS]->data;
            positions[place] = bad[i];
            expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[0] (positions)");
        }
    }
    float normals[12] = {0, 0, 1, 0, 0, 1, 0, NAN, 1, 0, 0, 1};
    add_mesh(&list, 1)->arrays[MESH_NORMALS] = make_blob(normals, sizeof(normals));
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[2] (normals)");
    float texcoords[8] = {0, 0, 1, 0, 0, 1, 0, INFINITY};
    add_mesh(&list, 1)->arrays[MESH_TEXCOORDS_1] = make_blob(texcoords, sizeof(texcoords));
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[5] (texture coordinates 1)");
    const float radii[][4] = {{0, 0, 0, 0}, {0, 0, 0, -1}, {0, 0, 0, NAN}, {0, INFINITY, 0, 1}};
    for (int i = 0; i < 4; i++) {
        float spheres[8] = {0, 0, 0, 1};
        memcpy(spheres + 4, radii[i], 16);
        add_spheres(&list, 2, spheres, 2);
        expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (spheres 2).arrays[0] (centres and radii)");
    }
    struct scene_environment *environment;
    list.edits[0] = (struct scene_edit){.kind = EDIT_SET_ENVIRONMENT};
    list.count = 1;
    environment = &list.edits[0].set.environment;
    environment->value.width = 2;
    environment->value.height = 1;
    environment->texels = make_blob((const uint16_t[]){0, 0, 0, 0, 0, 0x7c00, 0, 0}, 16);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (environment).arrays[0] (texels)");
}

TEST(indices_beyond_the_vertices_are_refused_wherever_they_stand)
{
    for (size_t place = 0; place < 6; place++) {
        uint32_t *indices = (uint32_t *)(void *)add_mesh(&list, 1)->arrays[MESH_INDICES]->data;
        indices[place] = place % 2 ? 4 : UINT32_MAX;
        expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).arrays[1] (indices)");
    }
}

/* Several threads look at a part each. */
TEST(a_large_mesh_is_checked_to_its_end_and_its_bounds_hold_each_used_vertex)
{
    enum { TRIANGLES = 200000, BAD = 150000 };
    for (int has_bad = 1; has_bad >= 0; has_bad--) {
        struct scene_mesh *mesh = add_mesh(&list, 1);
        blob_unref(mesh->arrays[MESH_INDICES]);
        mesh->arrays[MESH_INDICES] = blob_create((size_t)TRIANGLES * 12);
        assert_non_null(mesh->arrays[MESH_INDICES]);
        uint32_t *indices = (uint32_t *)(void *)mesh->arrays[MESH_INDICES]->data;
        memset(indices, 0, (size_t)TRIANGLES * 12);
        mesh->value.triangle_count = TRIANGLES;
        indices[3 * BAD + 1] = has_bad ? 4 : 1;
        indices[3 * TRIANGLES - 1] = has_bad ? 5 : 2;
        struct error error = {0};
        const bool accepted = scene_commit(scene, list.edits, list.count, &error);
        assert_int_equal(accepted, !has_bad);
        if (has_bad)
            assert_string_equal(error.text, "triangle 150000 refers to vertex 4 of 4");
        finish(&list);
    }
    const struct scene_mesh *mesh = scene_mesh(scene, 1);
    assert_float_equal(mesh->lower[0], 0, 0);
    assert_float_equal(mesh->upper[0], 1, 0);
    assert_float_equal(mesh->upper[1], 1, 0);
}

TEST(ranges_ascend_without_overlap_and_within_bounds)
{
    struct scene_mesh *mesh = add_mesh(&list, 1);
    add_range(mesh, 0, 2, 0);
    add_range(mesh, 1, 1, 0);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).ranges[1].first");
    mesh = add_mesh(&list, 1);
    add_range(mesh, 1, 1, 0);
    add_range(mesh, 0, 1, 0);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).ranges[1].first");
    add_range(add_mesh(&list, 1), 1, 2, 0);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).ranges[0].count");
    add_range(add_mesh(&list, 1), 1, UINT32_MAX, 0); /* the end wraps to 0 */
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (mesh 1).ranges[0].count");
    mesh = add_mesh(&list, 1);
    add_range(mesh, 0, 1, 0);
    add_range(mesh, 1, 1, 0);
    expect_commit(scene, &list);
}

TEST(lights_cameras_and_discs_make_sense)
{
    struct scene_light *light = &add_set(&list, OBJECT_LIGHT, 1)->set.light;
    light->value.kind = LIGHT_SPOT;
    light->value.inner_cone = 0.5f;
    light->value.outer_cone = 0.4f;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (light 1).outer_cone");
    add_set(&list, OBJECT_LIGHT, 1)->set.light.value.kind = LIGHT_RECTANGLE;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (light 1).size");
    add_set(&list, OBJECT_CAMERA, 2);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (camera 2).height");
    struct scene_disc *disc = &add_set(&list, OBJECT_DISC, 3)->set.disc;
    disc->value.normal_world[0] = 0.99f;
    disc->value.radius = 1;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (disc 3).normal_world");
}

TEST(bounds_are_those_of_the_vertices_in_use)
{
    struct scene_mesh *mesh = add_mesh(&list, 1);
    ((float *)(void *)mesh->arrays[MESH_POSITIONS]->data)[9] = -50; /* vertex 3 */
    uint32_t *indices = (uint32_t *)(void *)mesh->arrays[MESH_INDICES]->data;
    indices[5] = 1;
    const float spheres[8] = {1, 2, 3, 0.5f, -4, 0, 0, 2};
    add_spheres(&list, 1, spheres, 2);
    expect_commit(scene, &list);
    assert_memory_equal(scene_mesh(scene, 1)->lower, ((float[]){0, 0, 0}), 12);
    assert_memory_equal(scene_mesh(scene, 1)->upper, ((float[]){1, 1, 0}), 12);
    assert_memory_equal(scene_spheres(scene, 1)->lower, ((float[]){-6, -2, -2}), 12);
    assert_memory_equal(scene_spheres(scene, 1)->upper, ((float[]){1.5f, 2.5f, 3.5f}), 12);
}

/* ---- hierarchy ---------------------------------------------------------------------------------- */

TEST(parents_exist_and_circles_do_not)
{
    add_node(&list, 1, 2);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[0] (node 1).parent");
    add_node(&list, 1, 1);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (node 1).parent");
    add_node(&list, 1, 3);
    add_node(&list, 2, 1);
    add_node(&list, 3, 2);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (node 1).parent");
    add_node(&list, 1, 0);
    add_node(&list, 2, 1);
    add_node(&list, 3, 2);
    expect_commit(scene, &list);
    add_node(&list, 1, 3); /* the circle closes through nodes of an earlier transaction */
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (node 1).parent");
    assert_int_equal(scene_node(scene, 1)->value.parent, 0);
}

/* A chain of `length` nodes from the root, ids from `first`. */
static void commit_chain(uint32_t first, uint32_t length)
{
    for (uint32_t i = 0; i < length; i++) {
        add_node(&list, first + i, i ? first + i - 1 : 0);
        expect_commit(scene, &list);
    }
}

TEST(the_hierarchy_has_a_maximum_depth)
{
    commit_chain(1, SCENE_DEPTH_MAX);
    add_node(&list, 1000, SCENE_DEPTH_MAX);
    expect_refusal(scene, &list, ERROR_LIMIT, "edits[0] (node 1000).parent");
    /* A subtree that is moved down takes its depth along, though its lower nodes are not edited. */
    add_node(&list, 2000, 0);
    expect_commit(scene, &list);
    add_node(&list, 1, 2000);
    expect_refusal(scene, &list, ERROR_LIMIT, "edits[0] (node 1).parent");
    float world[12];
    assert_true(scene_world_from_node(scene, NULL, SCENE_DEPTH_MAX, world));
}

TEST(a_removed_node_takes_along_what_hangs_below_it)
{
    add_node(&list, 1, 0);
    add_node(&list, 2, 1);
    add_node(&list, 3, 2);
    add_shown(&list, 4, NODE_MESH, 1)->value.parent = 3;
    add_node(&list, 5, 1);
    add_mesh(&list, 1);
    expect_commit(scene, &list);
    /* A new child of what goes is refused, a moved one stays. */
    add_remove(&list, OBJECT_NODE, 2);
    add_node(&list, 6, 3);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[1] (node 6).parent");
    add_remove(&list, OBJECT_NODE, 2);
    add_node(&list, 6, 2);
    expect_refusal(scene, &list, ERROR_UNKNOWN_ID, "edits[1] (node 6).parent");
    add_remove(&list, OBJECT_NODE, 2);
    add_remove(&list, OBJECT_MESH, 1); /* its only user falls with node 2 */
    expect_commit(scene, &list);
    assert_int_equal(scene->objects[OBJECT_NODE].count, 2);
    assert_null(scene_node(scene, 4));
    assert_int_equal(scene_node(scene, 1)->child_count, 1);
    add_node(&list, 5, 0);
    add_remove(&list, OBJECT_NODE, 1);
    expect_commit(scene, &list);
    assert_int_equal(scene->objects[OBJECT_NODE].count, 1);
    assert_non_null(scene_node(scene, 5));
}

/* ---- limits and revisions ----------------------------------------------------------------------- */

TEST(limits_are_kept_and_reported)
{
    begin_with(&(struct scene_limits){.host_bytes = 1500, .nodes = 2});
    add_node(&list, 1, 0);
    add_node(&list, 2, 0);
    expect_commit(scene, &list);
    add_node(&list, 3, 0);
    expect_refusal(scene, &list, ERROR_LIMIT, "edits");
    add_node(&list, 3, 0);
    add_remove(&list, OBJECT_NODE, 1);
    expect_commit(scene, &list);
    const float spheres[4 * 60] = {[3] = 1};
    float numbers[4 * 60];
    memcpy(numbers, spheres, sizeof(numbers));
    for (int i = 0; i < 60; i++)
        numbers[4 * i + 3] = 1;
    add_spheres(&list, 1, numbers, 60);
    expect_refusal(scene, &list, ERROR_LIMIT, "edits");
}

TEST(the_depth_may_be_limited_further)
{
    begin_with(&(struct scene_limits){.depth = 3});
    commit_chain(1, 3);
    add_node(&list, 4, 3);
    expect_refusal(scene, &list, ERROR_LIMIT, "edits[0] (node 4).parent");
    add_node(&list, 1, 3); /* a circle is one, and not too deep, however little is allowed */
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (node 1).parent");
    add_node(&list, 4, 2);
    expect_commit(scene, &list);
    begin_with(&(struct scene_limits){.depth = SCENE_DEPTH_MAX + 1}); /* more than there can be */
    commit_chain(1, SCENE_DEPTH_MAX);
    add_node(&list, 1000, SCENE_DEPTH_MAX);
    expect_refusal(scene, &list, ERROR_LIMIT, "edits[0] (node 1000).parent");
}

struct revisions {
    uint64_t geometry, instances, shading, lights;
};

static void expect_touched(struct revisions expected)
{
    uint64_t r = scene->revision;
    struct revisions got = {scene->geometry_revision == r, scene->instances_revision == r,
                            scene->shading_revision == r, scene->lights_revision == r};
    if (memcmp(&got, &expected, sizeof(got)))
        fail_msg("geometry %d, instances %d, shading %d, lights %d; expected %d %d %d %d", (int)got.geometry,
                 (int)got.instances, (int)got.shading, (int)got.lights, (int)expected.geometry,
                 (int)expected.instances, (int)expected.shading, (int)expected.lights);
}

TEST(revisions_tell_what_a_transaction_touched)
{
    add_mesh(&list, 1);
    add_set(&list, OBJECT_LIGHT, 1);
    add_set(&list, OBJECT_CAMERA, 1)->set.camera.value.fov_y = 1;
    add_set(&list, OBJECT_MATERIAL, 1);
    add_shown(&list, 1, NODE_MESH, 1);
    add_shown(&list, 2, NODE_LIGHT, 1);
    add_shown(&list, 3, NODE_CAMERA, 1);
    add_node(&list, 4, 0);
    add_shown(&list, 5, NODE_MESH, 1)->value.parent = 4;
    expect_commit(scene, &list);
    expect_touched((struct revisions){1, 1, 1, 1});
    add_mesh(&list, 1);
    expect_commit(scene, &list);
    expect_touched((struct revisions){.geometry = 1});
    add_shown(&list, 1, NODE_MESH, 1)->value.hidden = true;
    expect_commit(scene, &list);
    expect_touched((struct revisions){.instances = 1});
    add_shown(&list, 2, NODE_LIGHT, 1);
    expect_commit(scene, &list);
    expect_touched((struct revisions){.lights = 1});
    add_shown(&list, 3, NODE_CAMERA, 1);
    expect_commit(scene, &list);
    expect_touched((struct revisions){0});
    add_node(&list, 4, 0); /* others hang below it */
    expect_commit(scene, &list);
    expect_touched((struct revisions){.instances = 1, .lights = 1});
    add_set(&list, OBJECT_MATERIAL, 1);
    expect_commit(scene, &list);
    expect_touched((struct revisions){.shading = 1});
    list.edits[0] = (struct scene_edit){.kind = EDIT_SET_ENVIRONMENT};
    list.count = 1;
    expect_commit(scene, &list);
    expect_touched((struct revisions){.lights = 1});
    assert_int_equal(scene->environment.revision, scene->revision);
    add_remove(&list, OBJECT_NODE, 1);
    expect_commit(scene, &list);
    expect_touched((struct revisions){.instances = 1});
}

static struct scene_environment *set_environment(size_t index)
{
    list.edits[index] = (struct scene_edit){.kind = EDIT_SET_ENVIRONMENT};
    list.count = index + 1;
    return &list.edits[index].set.environment;
}

TEST(an_environment_keeps_its_image_if_the_edit_says_so)
{
    static const uint16_t dark[4] = {0}, infinite[4] = {0x7c00};
    struct scene_edit read;
    struct error error = {0};
    struct scene_environment *environment = set_environment(0);
    environment->value.width = environment->value.height = 1;
    environment->texels = make_blob(dark, sizeof(dark));
    expect_commit(scene, &list);
    const struct blob *image = scene->environment.texels;
    const uint64_t bytes = scene->host_bytes;
    assert_true(scene_read_object(scene, OBJECT_ENVIRONMENT, 1, &read, &error));
    assert_true(read.set.environment.value.keeps_image && !read.set.environment.texels);
    set_environment(0)->value.colour[0] = 3;
    list.edits[0].set.environment.value.keeps_image = true;
    expect_commit(scene, &list);
    assert_true(scene->environment.texels == image && scene->environment.value.colour[0] == 3);
    assert_int_equal(scene->environment.value.width, 1);
    assert_int_equal(scene->host_bytes, bytes);
    /* The second of two edits keeps the image of the first, which is checked all the same. */
    environment = set_environment(0);
    environment->value.width = environment->value.height = 1;
    environment->texels = make_blob(infinite, sizeof(infinite));
    set_environment(1)->value.keeps_image = true;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[1] (environment).arrays[0] (texels)");
    set_environment(0)->value.keeps_image = true;
    list.edits[0].set.environment.value.backdrop = true;
    expect_refusal(scene, &list, ERROR_INVALID, "edits[0] (environment).backdrop");
    assert_true(scene->environment.texels == image);
}

/* ---- what is not looked at ---------------------------------------------------------------------- */

static const float square_with_nan[12] = {0, 0, 0, 1, 0, 0, NAN, 1, 0, 0, 1, 0};

static struct scene_mesh *add_bad_mesh(uint32_t id)
{
    struct scene_mesh *mesh = add_mesh(&list, id);
    memcpy(mesh->arrays[MESH_POSITIONS]->data, square_with_nan, sizeof(square_with_nan));
    return mesh;
}

TEST(an_edit_that_a_later_one_replaces_is_not_looked_at)
{
    add_bad_mesh(1);
    add_mesh(&list, 1);
    add_bad_mesh(2);
    add_remove(&list, OBJECT_MESH, 2);
    expect_commit(scene, &list);
    assert_true(scene_mesh(scene, 1)->upper[0] == 1.0f);
    add_mesh(&list, 1);
    add_bad_mesh(1);
    expect_refusal(scene, &list, ERROR_INVALID, "edits[1] (mesh 1).arrays[0] (positions)");
}

TEST(limits_are_looked_at_before_the_contents_of_arrays)
{
    begin_with(&(struct scene_limits){.host_bytes = 200});
    add_bad_mesh(1);
    expect_refusal(scene, &list, ERROR_LIMIT, "edits");
}

TEST(meshes_that_share_arrays_have_bounds_of_their_own)
{
    static const uint32_t first_triangle[6] = {0, 1, 2, 0, 1, 2}, edge[6] = {0, 1, 1, 0, 1, 1};
    struct blob *positions = add_mesh(&list, 1)->arrays[MESH_POSITIONS];
    for (uint32_t id = 2; id <= 4; id++) {
        struct scene_mesh *mesh = add_mesh(&list, id);
        blob_unref(mesh->arrays[MESH_POSITIONS]);
        mesh->arrays[MESH_POSITIONS] = blob_ref(positions);
    }
    blob_unref(list.edits[1].set.mesh.arrays[MESH_INDICES]); /* mesh 2 has both from mesh 1 */
    list.edits[1].set.mesh.arrays[MESH_INDICES] = blob_ref(list.edits[0].set.mesh.arrays[MESH_INDICES]);
    memcpy(list.edits[2].set.mesh.arrays[MESH_INDICES]->data, first_triangle, sizeof(first_triangle));
    memcpy(list.edits[3].set.mesh.arrays[MESH_INDICES]->data, edge, sizeof(edge));
    expect_commit(scene, &list);
    for (uint32_t id = 1; id <= 4; id++) {
        assert_true(scene_mesh(scene, id)->lower[1] == 0.0f);
        assert_true(scene_mesh(scene, id)->upper[0] == 1.0f);
        assert_true(scene_mesh(scene, id)->upper[1] == (id == 4 ? 0.0f : 1.0f));
    }
}

TEST(an_abandoned_transaction_changes_nothing)
{
    struct error error = {0};
    const atomic_bool abandoned = true;
    add_mesh(&list, 1);
    assert_false(scene_commit_unless(scene, list.edits, list.count, &abandoned, &error));
    assert_int_equal(error.kind, ERROR_CANCELLED);
    assert_int_equal(scene->revision, 0);
    assert_int_equal(scene->objects[OBJECT_MESH].count, 0);
    expect_commit(scene, &list);
}

/* The size of the largest model that is at hand; its time is printed. */
TEST(a_mesh_of_871_thousand_triangles_is_checked)
{
    const uint32_t triangles = 871414, vertices = 437645;
    struct scene_mesh *mesh = &add_set(&list, OBJECT_MESH, 1)->set.mesh;
    mesh->value.vertex_count = vertices;
    mesh->value.triangle_count = triangles;
    mesh->arrays[MESH_POSITIONS] = blob_create(vertices * 12ul);
    mesh->arrays[MESH_NORMALS] = blob_create(vertices * 12ul);
    mesh->arrays[MESH_INDICES] = blob_create(triangles * 12ul);
    float *positions = (float *)(void *)mesh->arrays[MESH_POSITIONS]->data;
    float *normals = (float *)(void *)mesh->arrays[MESH_NORMALS]->data;
    uint32_t *indices = (uint32_t *)(void *)mesh->arrays[MESH_INDICES]->data;
    for (uint32_t i = 0; i < vertices * 3; i++)
        positions[i] = normals[i] = (float)(i % 1000) - 500.0f;
    for (uint32_t i = 0; i < triangles * 3; i++)
        indices[i] = (i / 6 + i % 3 * 7) % vertices;
    uint64_t start_ns = clock_now_ns();
    expect_commit(scene, &list);
    print_message("%u triangles: %.2f ms\n", triangles, (double)(clock_now_ns() - start_ns) / 1e6);
    assert_true(scene_mesh(scene, 1)->lower[0] == -500.0f);
    assert_true(scene_mesh(scene, 1)->upper[2] == 499.0f);
}
