/* SPDX-License-Identifier: MIT */
/* Sums of an emission texture over a coarse grid, and means from them. */
#include "gpu_scene/emission_map.h"

#include "protocol/common/srgb.h"

#include <math.h>
#include <string.h>

#define CELLS EMISSION_MAP_CELLS

/* Range of the texels that begin in a cell, or the single one that contains it. */
static void texels_of(uint32_t cell, uint32_t texels, uint32_t *first, uint32_t *end)
{
    *first = (uint32_t)(((uint64_t)cell * texels + CELLS - 1) / CELLS);
    *end = (uint32_t)(((uint64_t)(cell + 1) * texels + CELLS - 1) / CELLS);
    if (*end > *first)
        return;
    *first = (uint32_t)((uint64_t)cell * texels / CELLS);
    *end = *first + 1;
}

static double cell_mean(const struct scene_texture *texture, const double linear[256], uint32_t x, uint32_t y)
{
    const uint8_t *texels = texture->texels->data;
    uint32_t x0, x1, y0, y1;
    texels_of(x, texture->value.width, &x0, &x1);
    texels_of(y, texture->value.height, &y0, &y1);
    double sum = 0.0;
    for (uint32_t v = y0; v < y1; v++)
        for (uint32_t u = x0; u < x1; u++)
            for (size_t c = 0; c < 3; c++)
                sum += linear[texels[((size_t)v * texture->value.width + u) * 4 + c]];
    return sum / (3.0 * (x1 - x0) * (y1 - y0));
}

void emission_map_init(struct emission_map *map, const struct scene_texture *texture)
{
    double linear[256];
    for (int i = 0; i < 256; i++)
        linear[i] = texture->value.format == TEXTURE_RGBA8_SRGB ? linear_from_srgb(i / 255.0) : i / 255.0;
    memset(map->sums, 0, sizeof(map->sums));
    map->texture = texture->base.id;
    map->width = texture->value.width;
    map->height = texture->value.height;
    for (uint32_t y = 0; y < CELLS; y++)
        for (uint32_t x = 0; x < CELLS; x++)
            map->sums[y + 1][x + 1] =
                cell_mean(texture, linear, x, y) + map->sums[y][x + 1] + map->sums[y + 1][x] - map->sums[y][x];
}

/* Sum over the cells from `first` on, which begin in the map. */
static double sum_of(const struct emission_map *map, const int first[2], const int count[2])
{
    const int x0 = first[0], y0 = first[1], x1 = first[0] + count[0], y1 = first[1] + count[1];
    return map->sums[y1][x1] - map->sums[y0][x1] - map->sums[y1][x0] + map->sums[y0][x0];
}

/* Cells along one axis: those of the bounds and their neighbours. Bounds that extend over an edge of the
 * texture count all of it, whatever is beyond the edge. */
static void cells_along(const float uv[3][2], int axis, uint32_t texels, int *first, int *count)
{
    const double rim = 1.0 / texels;
    const double lower = (double)fminf(fminf(uv[0][axis], uv[1][axis]), uv[2][axis]) - rim;
    const double upper = (double)fmaxf(fmaxf(uv[0][axis], uv[1][axis]), uv[2][axis]) + rim;
    *first = 0;
    *count = CELLS;
    if (!isfinite(lower) || !isfinite(upper) || floor(lower) != floor(upper))
        return;
    const int low = (int)((lower - floor(lower)) * CELLS), high = (int)((upper - floor(upper)) * CELLS);
    *first = low < CELLS - 1 ? low : CELLS - 1;
    *count = (high < CELLS - 1 ? high : CELLS - 1) - *first + 1;
}

float emission_map_mean(const struct emission_map *map, const float uv[3][2])
{
    int first[2], count[2];
    cells_along(uv, 0, map->width, &first[0], &count[0]);
    cells_along(uv, 1, map->height, &first[1], &count[1]);
    return (float)fmax(sum_of(map, first, count) / (count[0] * count[1]), 0.0);
}
