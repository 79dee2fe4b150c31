/* SPDX-License-Identifier: MIT */
/* How far what is shown reaches in a direction, against a plain search. */
#include "scene/affine.h"
#include "tests/unit/scene/drafts.h"
#include "tests/harness/test.h"

#include <math.h>

#define VERTICES 300u

static const double directions[SCENE_SUPPORTS_MAX][3] = {
    {1, 0, 0}, {-0.5, 0.25, 2}, {0, -1, 0.1}, {0.3, 0.6, -1}, {-1, -1, -1}};

static double along(size_t i, const float point[3])
{
    return directions[i][0] * (double)point[0] + directions[i][1] * (double)point[1] +
           directions[i][2] * (double)point[2];
}

/* Points of a ball; the triangles use those from `first` on. */
static void add_cloud(struct draft_list *list, uint32_t id, uint32_t first, uint32_t triangles)
{
    float positions[VERTICES * 3];
    uint32_t state = 7, *indices = malloc((size_t)triangles * 12);
    assert_non_null(indices);
    for (size_t i = 0; i < VERTICES * 3; i++) {
        state = state * 1664525u + 1013904223u;
        positions[i] = (float)(state >> 8) / 8388608.0f - 1.0f;
    }
    for (uint32_t i = 0; i < triangles * 3; i++)
        indices[i] = first + i % (VERTICES - first);
    struct scene_mesh *mesh = &add_set(list, OBJECT_MESH, id)->set.mesh;
    mesh->value.vertex_count = VERTICES;
    mesh->value.triangle_count = triangles;
    mesh->arrays[MESH_POSITIONS] = make_blob(positions, sizeof(positions));
    mesh->arrays[MESH_INDICES] = make_blob(indices, (size_t)triangles * 12);
    free(indices);
}

static void expect_supports(const struct scene *scene, uint32_t root, const double expected[SCENE_SUPPORTS_MAX])
{
    double supports[SCENE_SUPPORTS_MAX];
    assert_true(scene_supports_below(scene, NULL, root, NULL, directions, supports, SCENE_SUPPORTS_MAX));
    for (size_t i = 0; i < SCENE_SUPPORTS_MAX; i++)
        if (fabs(supports[i] - expected[i]) > 1e-5) /* plain points have numbers up to 30 as floats */
            fail_msg("direction %zu: %.9g, expected %.9g", i, supports[i], expected[i]);
}

static void reach_of_used(const struct scene *scene, uint32_t node, double expected[SCENE_SUPPORTS_MAX])
{
    const struct scene_mesh *mesh = scene_mesh(scene, scene_node(scene, node)->value.object);
    const float *positions = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data;
    const uint32_t *indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data;
    float world_from_node[12], point[3];
    assert_true(scene_world_from_node(scene, NULL, node, world_from_node));
    for (uint32_t k = 0; k < mesh->value.triangle_count * 3; k++) {
        affine_point(point, world_from_node, positions + 3 * (size_t)indices[k]);
        for (size_t i = 0; i < SCENE_SUPPORTS_MAX; i++)
            expected[i] = fmax(expected[i], along(i, point));
    }
}

#define ANGLES 2000

/* The greatest of a place as it turns about the axis; an angle between two of these reaches 2e-6 of its way
 * farther. */
static double turned_along(size_t i, const float place[3], const double axis[2])
{
    double most = -INFINITY;
    for (int k = 0; k < ANGLES; k++) {
        const double angle = 2 * 3.14159265358979 * k / ANGLES, x = (double)place[0] - axis[0],
                     z = (double)place[2] - axis[1];
        const float turned[3] = {(float)(axis[0] + cos(angle) * x - sin(angle) * z), place[1],
                                 (float)(axis[1] + sin(angle) * x + cos(angle) * z)};
        most = fmax(most, along(i, turned));
    }
    return most;
}

TEST(what_turns_about_an_axis_reaches_as_far_as_all_its_places)
{
    static const double axis[2] = {1.5, -2};
    static const float places[] = {4, 1, 0, 4, 3, 0, 4, 1, -3, -2, 0.5f, 1, -2, 0.5f, 2, -2, 0, 1};
    static const uint32_t indices[] = {0, 1, 2, 3, 4, 5};
    struct scene *scene = scene_create("test", NULL);
    struct draft_list list = {0};
    double supports[SCENE_SUPPORTS_MAX];
    assert_non_null(scene);
    struct scene_mesh *mesh = &add_set(&list, OBJECT_MESH, 1)->set.mesh;
    mesh->value.vertex_count = 6;
    mesh->value.triangle_count = 2;
    mesh->arrays[MESH_POSITIONS] = make_blob(places, sizeof(places));
    mesh->arrays[MESH_INDICES] = make_blob(indices, sizeof(indices));
    add_shown(&list, 1, NODE_MESH, 1);
    expect_commit(scene, &list);
    assert_true(scene_supports_below(scene, NULL, 0, axis, directions, supports, SCENE_SUPPORTS_MAX));
    for (size_t i = 0; i < SCENE_SUPPORTS_MAX; i++) {
        double expected = -INFINITY;
        for (size_t k = 0; k < 6; k++)
            expected = fmax(expected, turned_along(i, places + 3 * k, axis));
        assert_true(fabs(supports[i] - expected) < 3e-5); /* distances are up to 12 */
    }
    scene_destroy(scene);
}

TEST(supports_are_those_of_the_vertices_that_triangles_use)
{
    static const float turned[12] = {0, -3, 1, 10, 2, 0, 0, -4, 0, 1, 5, 7};
    struct scene *scene = scene_create("test", NULL);
    struct draft_list list = {0};
    assert_non_null(scene);
    add_cloud(&list, 1, 0, VERTICES);     /* more corners than vertices */
    add_cloud(&list, 2, VERTICES - 9, 3); /* whose other vertices are those of others */
    memcpy(add_shown(&list, 1, NODE_MESH, 1)->value.parent_from_node, turned, sizeof(turned));
    memcpy(add_shown(&list, 2, NODE_MESH, 2)->value.parent_from_node, turned, sizeof(turned));
    add_shown(&list, 3, NODE_MESH, 1);
    add_shown(&list, 4, NODE_MESH, 1)->value.hidden = true;
    expect_commit(scene, &list);
    double all[SCENE_SUPPORTS_MAX], few[SCENE_SUPPORTS_MAX];
    for (size_t i = 0; i < SCENE_SUPPORTS_MAX; i++)
        all[i] = few[i] = -INFINITY;
    reach_of_used(scene, 2, few);
    expect_supports(scene, 2, few);
    for (uint32_t node = 1; node <= 3; node++)
        reach_of_used(scene, node, all);
    expect_supports(scene, 0, all);
    scene_destroy(scene);
}

TEST(spheres_and_discs_reach_as_far_as_their_surfaces)
{
    struct scene *scene = scene_create("test", NULL);
    struct draft_list list = {0};
    double expected[SCENE_SUPPORTS_MAX], supports[SCENE_SUPPORTS_MAX];
    assert_non_null(scene);
    assert_false(scene_supports_below(scene, NULL, 0, NULL, directions, supports, SCENE_SUPPORTS_MAX));
    struct scene_disc *disc = &add_set(&list, OBJECT_DISC, 1)->set.disc;
    disc->value.normal_world[1] = 1;
    disc->value.radius = 9;
    expect_commit(scene, &list);
    for (size_t i = 0; i < SCENE_SUPPORTS_MAX; i++)
        expected[i] = 9 * hypot(directions[i][0], directions[i][2]);
    expect_supports(scene, 0, expected);
    const float two[] = {3, 0, 0, 1, -2, 1, 0, 0.5f};
    add_spheres(&list, 1, two, 2);
    struct scene_node *node = add_shown(&list, 1, NODE_SPHERES, 1);
    node->value.parent_from_node[0] = node->value.parent_from_node[5] = node->value.parent_from_node[10] = 2;
    expect_commit(scene, &list);
    for (size_t i = 0; i < SCENE_SUPPORTS_MAX; i++) {
        const double length =
            sqrt(along(i, (float[]){(float)directions[i][0], (float)directions[i][1], (float)directions[i][2]}));
        expected[i] = 2 * fmax(along(i, &two[0]) + length, along(i, &two[4]) + 0.5 * length);
    }
    expect_supports(scene, 0, expected);
    scene_destroy(scene);
}
