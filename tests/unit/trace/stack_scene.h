/* SPDX-License-Identifier: MIT */
/* A scene of as many layers as a test wants. */
#ifndef FARLIGHT_TESTS_STACK_SCENE_H
#define FARLIGHT_TESTS_STACK_SCENE_H

#include "tests/accuracy/test_scenes.h"

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

#endif
