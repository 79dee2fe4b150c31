/* SPDX-License-Identifier: MIT */
/* Boxes, and scenes of as many layers as a test wants. */
#ifndef FARLIGHT_TESTS_STACK_SCENE_H
#define FARLIGHT_TESTS_STACK_SCENE_H

#include "tests/accuracy/test_scenes.h"

#include "shared/ray.h"

/* A closed box, -1..1 on each side. */
static inline struct scene_mesh *add_box_mesh(struct test_edits *edits, uint32_t id)
{
    static const uint32_t quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    float positions[8][3];
    uint32_t triangles[12][3];
    for (uint32_t i = 0; i < 8; i++)
        for (uint32_t k = 0; k < 3; k++)
            positions[i][k] = i >> k & 1 ? 1.0f : -1.0f;
    for (uint32_t i = 0; i < 6; i++) {
        const uint32_t *q = quads[i];
        memcpy(triangles[2 * i], (uint32_t[3]){q[0], q[1], q[2]}, sizeof(triangles[0]));
        memcpy(triangles[2 * i + 1], (uint32_t[3]){q[0], q[2], q[3]}, sizeof(triangles[0]));
    }
    struct scene_mesh *mesh =
        test_mesh(edits, id, (const float(*)[3])positions, 8, (const uint32_t *)triangles, 12);
    mesh->value.closed = true;
    return mesh;
}

enum stack_order { FRONT_TO_BACK, BACK_TO_FRONT, SHUFFLED };

/* Squares across z, slightly tilted; each twice, the second time with another winding, if they are `doubled`. */
static inline struct scene *stack_scene(uint32_t count, enum stack_order order, bool doubled)
{
    struct test_edits edits = {.scene = test_scene_create()};
    float(*positions)[3] = malloc(count * 4 * sizeof(*positions));
    uint32_t *indices = malloc(count * 12 * sizeof(*indices)), triangles = 0;
    uint64_t seed = 3;
    for (uint32_t i = 0; i < count; i++) {
        /* Multiplying by a number that shares no divisor with it visits every square once. */
        uint32_t place = order == FRONT_TO_BACK ? i : order == BACK_TO_FRONT ? count - 1 - i : i * 7919u % count;
        for (uint32_t v = 0; v < 4; v++) {
            positions[4 * i + v][0] = v & 1 ? 1.0f : -1.0f;
            positions[4 * i + v][1] = v & 2 ? 1.0f : -1.0f;
            positions[4 * i + v][2] =
                2 * ((float)place + 0.5f + test_uniform(&seed, -0.3f, 0.3f)) / (float)count - 1;
        }
        const uint32_t faces[4][3] = {{0, 1, 2}, {2, 1, 3}, {0, 2, 1}, {2, 3, 1}};
        for (uint32_t face = 0; face < (doubled ? 4 : 2); face++, triangles++)
            for (int k = 0; k < 3; k++)
                indices[3 * triangles + (uint32_t)k] = 4 * i + faces[face][k];
    }
    test_mesh(&edits, 1, (const float(*)[3])positions, count * 4, indices, triangles);
    test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
    test_commit(&edits);
    free(positions);
    free(indices);
    return edits.scene;
}

/* Squares across z from z = 0 up, from -1 to 1 along x and y. */
static inline struct scene *sheets_scene(uint32_t count, float apart)
{
    struct test_edits edits = {.scene = test_scene_create()};
    static const uint32_t indices[6] = {0, 1, 2, 2, 1, 3};
    for (uint32_t i = 0; i < count; i++) {
        const float z = apart * (float)i, positions[4][3] = {{-1, -1, z}, {1, -1, z}, {-1, 1, z}, {1, 1, z}};
        test_mesh(&edits, 1 + i, positions, 4, indices, 2);
        test_node(&edits, 1 + i, 0, NODE_MESH, 1 + i, NULL);
    }
    test_commit(&edits);
    return edits.scene;
}

/* Rays that go along between sheets without a hit. */
static inline void rays_between_sheets(struct ray *rays, uint32_t count, uint32_t sheets, float apart)
{
    uint64_t seed = 31;
    for (uint32_t i = 0; i < count; i++)
        rays[i] =
            (struct ray){{-1.1f, test_uniform(&seed, -0.9f, 0.9f), apart * ((float)(i % (sheets - 1)) + 0.5f), 0},
                         {1, test_uniform(&seed, -0.9f, 0.9f), 0, 1e30f}};
}

#endif
