/* SPDX-License-Identifier: MIT */
/* Curved and flat surfaces before an eye at the origin that looks along -z, for the tests of quadtrees. */
#ifndef FARLIGHT_TESTS_QUADTREE_SCENES_H
#define FARLIGHT_TESTS_QUADTREE_SCENES_H

#include "tests/accuracy/test_scenes.h"

typedef void surface_point(float u, float v, float point[3]);

/* A surface over the unit square, of 2 columns rows triangles. */
static inline void add_surface(struct test_edits *edits, uint32_t id, uint32_t columns, uint32_t rows,
                               surface_point *at)
{
    const uint32_t points = (columns + 1) * (rows + 1);
    float(*positions)[3] = malloc(points * sizeof(*positions));
    uint32_t *indices = malloc((size_t)columns * rows * 6 * sizeof(*indices)), n = 0;
    for (uint32_t i = 0; i < points; i++)
        at((float)(i % (columns + 1)) / (float)columns, (float)(i / (columns + 1)) / (float)rows, positions[i]);
    for (uint32_t i = 0; i < columns * rows; i++) {
        const uint32_t a = i / columns * (columns + 1) + i % columns, b = a + columns + 1;
        const uint32_t corners[6] = {a, a + 1, b, b, a + 1, b + 1};
        memcpy(indices + n, corners, sizeof(corners));
        n += 6;
    }
    test_mesh(edits, id, (const float(*)[3])positions, points, indices, 2 * columns * rows);
    free(positions);
    free(indices);
}

static inline void hills(float u, float v, float point[3])
{
    point[0] = 9 * u - 4.5f;
    point[2] = -0.9f - 6 * v;
    point[1] = -0.8f + 0.15f * sinf(2 * point[0]) * cosf(1.7f * point[2]);
}

static inline void ball(float u, float v, float point[3])
{
    const float phi = 6.2831853f * u, theta = 3.1415926f * v;
    point[0] = sinf(theta) * cosf(phi);
    point[1] = cosf(theta);
    point[2] = sinf(theta) * sinf(phi);
}

static inline void add_disc(struct test_edits *edits)
{
    struct scene_disc *disc = &test_add(edits, OBJECT_DISC)->set.disc;
    disc->base.id = 1;
    disc->value.material = 1;
    disc->value.centre_world[2] = -7.5f;
    disc->value.normal_world[0] = 0.28f;
    disc->value.normal_world[2] = 0.96f;
    disc->value.radius = 3;
}

/* Hills, balls of triangles, round and squeezed, spheres likewise, and a disc behind them. */
static inline struct scene *curved_scene(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    const float spheres[2][4] = {{1.1f, 0.3f, -2.2f, 0.45f}, {0.2f, 0.9f, -3.0f, 0.3f}};
    float m[12];
    test_material(&edits, 1, 0.5f, 0.5f, 0.5f);
    add_surface(&edits, 10, 96, 96, hills);
    add_surface(&edits, 11, 64, 40, ball);
    test_spheres(&edits, 20, spheres, 2);
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_transform(m, 0.5f, 0.5f, 0.5f, 1, 0.3f, -0.8f, 0.2f, -2.0f);
    test_node(&edits, 2, 0, NODE_MESH, 11, m);
    test_transform(m, 0.9f, 0.3f, 0.6f, 2, 0.7f, 0.3f, 0.1f, -4.0f);
    test_node(&edits, 3, 0, NODE_MESH, 11, m);
    test_node(&edits, 4, 0, NODE_SPHERES, 20, NULL);
    test_transform(m, -1.4f, 0.6f, 0.8f, 2, -0.4f, 0.1f, 0.3f, -1.5f);
    test_node(&edits, 5, 0, NODE_SPHERES, 20, m);
    add_disc(&edits);
    test_commit(&edits);
    return edits.scene;
}

/* A tilted triangle that covers a view of up to 120 degrees, from 0.6 metres away to 30. */
static inline struct scene *flat_scene(void)
{
    static const float positions[3][3] = {{-3, -1, 2}, {60, -20, -30}, {-60, 70, -30}};
    static const uint32_t indices[3] = {0, 1, 2};
    struct test_edits edits = {.scene = test_scene_create()};
    test_mesh(&edits, 10, positions, 3, indices, 1);
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    return edits.scene;
}

#endif
