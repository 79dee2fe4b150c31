/* SPDX-License-Identifier: MIT */
/* Bodies: closed meshes whose columns balance. */
#ifndef FARLIGHT_TESTS_ABUFFER_SCENES_H
#define FARLIGHT_TESTS_ABUFFER_SCENES_H

#include "tests/accuracy/motion_scenes.h"
#include "tests/unit/trace/stack_scene.h"

/* A ball (or a torus) of steps x steps quadrilaterals, vertices shared, the outside out; no attributes. */
static inline struct scene_mesh *add_round_mesh(struct test_edits *edits, uint32_t id, uint32_t steps, bool torus)
{
    uint32_t rows = torus ? steps : steps - 1, vertices = rows * steps + (torus ? 0 : 2), count = 0;
    float(*positions)[3] = malloc(vertices * sizeof(*positions));
    uint32_t(*triangles)[3] = malloc(2 * (size_t)steps * steps * sizeof(*triangles));
    for (uint32_t i = 0; i < rows * steps; i++) {
        double a = 2 * 3.14159265358979 * (i % steps) / steps;
        double b = torus ? 2 * 3.14159265358979 * (i / steps) / steps
                         : 3.14159265358979 * (1 + i / steps) / steps; /* for a torus: from outermost, upwards */
        double across = torus ? 0.7 + 0.3 * cos(b) : sin(b), up = torus ? 0.3 * sin(b) : -cos(b);
        memcpy(positions[i], (float[3]){(float)(across * cos(a)), (float)(across * sin(a)), (float)up},
               sizeof(positions[i]));
    }
    for (uint32_t row = 0; row + (torus ? 0 : 1) < rows; row++)
        for (uint32_t k = 0; k < steps; k++) {
            uint32_t p = row * steps + k, q = row * steps + (k + 1) % steps;
            uint32_t above = (row + 1) % rows * steps;
            uint32_t r = above + k, s = above + (k + 1) % steps;
            memcpy(triangles[count++], (uint32_t[3]){p, q, s}, sizeof(triangles[0]));
            memcpy(triangles[count++], (uint32_t[3]){p, s, r}, sizeof(triangles[0]));
        }
    for (uint32_t k = 0; k < steps && !torus; k++) {
        uint32_t top = (rows - 1) * steps, low = vertices - 2, high = vertices - 1;
        memcpy(positions[low], (float[3]){0, 0, -1}, sizeof(positions[0]));
        memcpy(positions[high], (float[3]){0, 0, 1}, sizeof(positions[0]));
        memcpy(triangles[count++], (uint32_t[3]){low, (k + 1) % steps, k}, sizeof(triangles[0]));
        memcpy(triangles[count++], (uint32_t[3]){high, top + k, top + (k + 1) % steps}, sizeof(triangles[0]));
    }
    struct scene_mesh *mesh =
        test_mesh(edits, id, (const float(*)[3])positions, vertices, (const uint32_t *)triangles, count);
    mesh->value.closed = true;
    free(positions);
    free(triangles);
    return mesh;
}

/* Bodies beside, in, and through each other; turned, mirrored, squeezed; a box along the axes, which has sides
 * that are parallel to them; one that is shown twice at the same place. */
static inline struct scene *scene_of_bodies(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    float m[12];
    add_round_mesh(&edits, 10, 24, false);
    add_round_mesh(&edits, 11, 20, true);
    add_box_mesh(&edits, 12);
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_transform(m, 0.5f, 0.5f, 0.5f, 0, 0, 0.1f, 0.2f, 0);
    test_node(&edits, 2, 0, NODE_MESH, 12, m); /* in it */
    test_transform(m, 0.8f, -0.8f, 0.8f, 1, 0.9f, 1.2f, 0.1f, 0.3f);
    test_node(&edits, 3, 0, NODE_MESH, 11, m); /* through it, mirrored */
    test_transform(m, 0.9f, 0.3f, 0.7f, 2, 0.6f, -1.3f, 0.8f, 0);
    test_node(&edits, 4, 0, NODE_MESH, 10, m); /* squeezed */
    test_transform(m, 0.4f, 0.7f, -0.6f, 0, 0.4f, 0.2f, -1.6f, 0.4f);
    test_node(&edits, 5, 0, NODE_MESH, 12, m);
    test_node(&edits, 6, 0, NODE_MESH, 12, m);
    test_commit(&edits);
    return edits.scene;
}

/* Beside what is none: a soup, and spheres. */
static inline struct scene *scene_of_bodies_and_others(void)
{
    struct scene *scene = scene_of_bodies();
    struct test_edits edits = {.scene = scene};
    float spheres[6][4];
    uint64_t seed = 9;
    for (int i = 0; i < 6; i++)
        for (int k = 0; k < 4; k++)
            spheres[i][k] = k < 3 ? test_uniform(&seed, -1.5f, 1.5f) : test_uniform(&seed, 0.1f, 0.6f);
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    test_soup_mesh(&edits, 20, 60, 0.5f, 4);
    test_spheres(&edits, 30, (const float(*)[4])spheres, 6);
    test_node(&edits, 20, 0, NODE_MESH, 20, NULL);
    test_node(&edits, 30, 0, NODE_SPHERES, 30, NULL);
    test_commit(&edits);
    return scene;
}

/* Closed meshes, and spheres, of which something is cut out: they are bodies no more. */
static inline struct scene *scene_of_cut_bodies(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    const struct record_material_range ranges[] = {{0, 100, 1}};
    const float spheres[2][4] = {{2, 0, 0, 0.6f}, {2, 1, 0, 0.7f}};
    struct scene_material *cutout = test_material(&edits, 1, 0.4f, 0.5f, 0.6f);
    cutout->value.alpha_mode = ALPHA_MASK;
    cutout->value.base_colour[3] = 0.25f; /* below its cutoff: none of it is there */
    struct scene_mesh *mesh = add_round_mesh(&edits, 10, 16, false);
    mesh->ranges = test_ranges(ranges, 1);
    mesh->range_count = 1;
    struct scene_spheres *set = test_spheres(&edits, 20, spheres, 2);
    set->ranges = test_ranges((const struct record_material_range[]){{1, 1, 1}}, 1);
    set->range_count = 1;
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_node(&edits, 2, 0, NODE_SPHERES, 20, NULL);
    test_commit(&edits);
    return edits.scene;
}

#endif
