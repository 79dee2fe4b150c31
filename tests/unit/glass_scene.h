/* SPDX-License-Identifier: MIT */
/* Glass whose every crossing leaves half of red, a quarter of green, all of blue. */
#ifndef FARLIGHT_TESTS_GLASS_SCENE_H
#define FARLIGHT_TESTS_GLASS_SCENE_H

#include "tests/accuracy/test_scenes.h"

#include <math.h>

/* One triangle, whose material has the index 1 on the device. */
static inline struct scene *scene_of_glass(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    test_material(&edits, 1, 0.5f, 0.25f, 1)->transmission = 1;
    const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const uint32_t indices[3] = {0, 1, 2};
    const struct material_range ranges[] = {{0, 1, 1}};
    struct scene_mesh *mesh = test_mesh(&edits, 10, corners, 3, indices, 1);
    mesh->ranges = test_ranges(ranges, 1);
    mesh->range_count = 1;
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    return edits.scene;
}

/* Whether that is left of light after so many crossings. */
static inline bool is_tint(uint32_t visibility, int crossings)
{
    const float expected[3] = {powf(0.5f, (float)crossings), powf(0.25f, (float)crossings), 1};
    for (int k = 0; k < 3; k++)
        if (fabsf((float)(visibility >> 8 * k & 255) - 255 * expected[k]) > 1)
            return false;
    return true;
}

#endif
