/* SPDX-License-Identifier: MIT */
/* Brightness of an emission texture in each part of it: sums over a coarse grid. */
#ifndef FARLIGHT_GPU_SCENE_EMISSION_MAP_H
#define FARLIGHT_GPU_SCENE_EMISSION_MAP_H

#include "scene/scene.h"

#define EMISSION_MAP_CELLS 64

struct emission_map {
    uint32_t texture; /* id of the texture */
    uint32_t width, height;
    /* Means of the texels, r, g and b together, 0 .. 1; summed over all cells to the left and above. */
    double sums[EMISSION_MAP_CELLS + 1][EMISSION_MAP_CELLS + 1];
};

void emission_map_init(struct emission_map *map, const struct scene_texture *texture);
/* Mean around a triangle: over all cells of its bounds and their neighbours, which a filtered texel reaches, so
 * it is 0 only where the triangle is black. `uv`: texture coordinates of its corners. */
float emission_map_mean(const struct emission_map *map, const float uv[3][2]);

#endif
