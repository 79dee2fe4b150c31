// SPDX-License-Identifier: MIT
/* Elements in the device's layout. */
#include "trace/tree/build.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* The grid's cells begin this far inside it, so that rounding outward stays within. */
#define GRID_INNER 2.0
/* A box's corners are moved outward by this much of a cell before they are rounded outward: the rounding of the
 * traversal's arithmetic on coordinates of up to BVH_GRID_CELLS cells (shaders/tree/slack.glsl), 2^-24 each, 8
 * times.
 */
#define GRID_PAD (8.0 * BVH_GRID_CELLS / 16777216.0)
/* An axis along which a tree has (almost) no extent gets cells of this share of its largest one. */
#define GRID_FLATNESS 0x1p-20

struct bvh_form bvh_top_form(const struct bvh_form *settings)
{
    struct bvh_form form = *settings;
    form.wide = false;
    return form;
}

uint32_t bvh_octants(const struct bvh_form *settings)
{
    return settings->one_order || settings->wide ? 1 : BVH_OCTANTS;
}

bool bvh_is_packed(const struct bvh_form *settings)
{
    return !settings->spheres && !settings->whole && !settings->wide;
}

uint32_t bvh_element_words(const struct bvh_form *settings)
{
    if (settings->wide)
        return sizeof(struct bvh_wide_node) / 4;
    return bvh_is_packed(settings) ? sizeof(struct bvh_packed_element) / 4 : sizeof(struct bvh_element) / 4;
}

size_t bvh_element_bytes(const struct bvh_form *settings)
{
    return (size_t)bvh_octants(settings) * bvh_element_words(settings) * sizeof(uint32_t);
}

uint32_t bvh_leaf(uint32_t kind, uint32_t first, uint32_t count)
{
    return kind << BVH_LEAF_KIND_SHIFT | (count - 1) << BVH_LEAF_COUNT_SHIFT | first;
}

float bvh_box_area(const float lower[3], const float upper[3])
{
    float x = upper[0] - lower[0], y = upper[1] - lower[1], z = upper[2] - lower[2];
    return x * y + y * z + z * x;
}

void bvh_pad_box(float lower[3], float upper[3])
{
    for (int i = 0; i < 3; i++) {
        lower[i] -= fabsf(lower[i]) * BVH_PAD_RELATIVE + FLT_MIN;
        upper[i] += fabsf(upper[i]) * BVH_PAD_RELATIVE + FLT_MIN;
    }
}

struct bvh_bound bvh_bound_of_box(const float lower[3], const float upper[3])
{
    struct bvh_bound bound;
    memcpy(bound.lower, lower, sizeof(bound.lower));
    memcpy(bound.upper, upper, sizeof(bound.upper));
    bvh_pad_box(bound.lower, bound.upper);
    return bound;
}

struct bvh_bound bvh_bound_of_sphere(const float centre[3], float radius)
{
    float magnitude = fabsf(centre[0]) + fabsf(centre[1]) + fabsf(centre[2]) + radius;
    struct bvh_bound bound = {.upper = {radius + magnitude * BVH_PAD_RELATIVE + FLT_MIN}};
    memcpy(bound.lower, centre, sizeof(bound.lower));
    return bound;
}

/* ---- grid ---- */

/* The largest float that is not greater. */
static float float_below(double x)
{
    float near = (float)x;
    return (double)near > x ? nextafterf(near, -INFINITY) : near;
}

/* Doubles, as extents reach twice the largest float. */
struct bvh_grid bvh_grid_over(const float lower[3], const float upper[3], float room)
{
    struct bvh_grid grid;
    double maximum = 0;
    for (int i = 0; i < 3; i++)
        maximum = fmax(maximum, ((double)upper[i] - lower[i]));
    for (int i = 0; i < 3; i++) {
        double extent = fmax((double)upper[i] - lower[i], maximum * GRID_FLATNESS);
        extent = fmax(extent, fmax(fabs((double)lower[i]), fabs((double)upper[i])) * GRID_FLATNESS);
        extent = fmax(extent, (double)FLT_MIN / GRID_FLATNESS) * (1 + 2 * (double)room);
        double middle = ((double)lower[i] + (double)upper[i]) / 2;
        double begin = middle - extent * (0.5 + GRID_INNER / (BVH_GRID_CELLS - 2 * GRID_INNER));
        /* Far from the origin a float is coarser than a cell: the grid begins at the next float below, and its
         * cells extend from there. */
        grid.lower[i] = float_below(fmax(begin, -FLT_MAX));
        double cell = (middle + extent / 2 - (double)grid.lower[i]) / (BVH_GRID_CELLS - GRID_INNER);
        grid.cells_per_unit[i] = fmaxf(float_below(1 / cell), FLT_MIN);
    }
    return grid;
}

bool bvh_grid_cells(const struct bvh_grid *grid, const float lower[3], const float upper[3], uint32_t cells[3][2])
{
    bool inside = true;
    for (int i = 0; i < 3; i++) {
        double low = floor(((double)lower[i] - grid->lower[i]) * grid->cells_per_unit[i] - GRID_PAD);
        double high = ceil(((double)upper[i] - grid->lower[i]) * grid->cells_per_unit[i] + GRID_PAD);
        inside = inside && low >= 0 && high <= BVH_GRID_CELLS;
        cells[i][0] = low > 0 ? (uint32_t)fmin(low, BVH_GRID_CELLS) : 0;
        cells[i][1] = high > 0 ? (uint32_t)fmin(high, BVH_GRID_CELLS) : 0;
    }
    return inside;
}

float bvh_grid_area(const struct bvh_grid *grid, uint32_t cells[3][2])
{
    static const float none[3];
    float extent[3];
    for (int i = 0; i < 3; i++)
        extent[i] = (float)(cells[i][1] - cells[i][0]) / grid->cells_per_unit[i];
    return bvh_box_area(none, extent);
}

/* ---- elements ---- */

static void write_packed(uint32_t *elements, const struct bvh_baked *baked, const struct bvh_grid *grid,
                         uint32_t e, const struct bvh_bound *bound, uint32_t leaf)
{
    uint32_t cells[3][2];
    bvh_grid_cells(grid, bound->lower, bound->upper, cells);
    for (uint32_t octant = 0; octant < (baked->place ? BVH_OCTANTS : 1); octant++) {
        size_t count = baked->element_count;
        uint32_t place = baked->place ? baked->place[octant * count + e] : e;
        uint32_t *out = elements + 4 * (octant * count + place);
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t near = octant >> i & 1;
            out[i] = cells[i][near] | cells[i][1 - near] << 16;
        }
        out[3] = leaf ? leaf : place + baked->size[e];
    }
}

void bvh_write_element(uint32_t *elements, const struct bvh_form *settings, const struct bvh_baked *baked,
                       const struct bvh_grid *grid, uint32_t e, const struct bvh_bound *bound, uint32_t leaf)
{
    if (bvh_is_packed(settings)) {
        write_packed(elements, baked, grid, e, bound, leaf);
        return;
    }
    for (uint32_t octant = 0; octant < bvh_octants(settings); octant++) {
        size_t count = baked->element_count;
        uint32_t place = baked->place ? baked->place[octant * count + e] : e;
        const struct bvh_element element = {
            .lower_x = bound->lower[0],
            .lower_y = bound->lower[1],
            .lower_z = bound->lower[2],
            .link = leaf ? leaf : place + baked->size[e],
            .upper_x = bound->upper[0],
            .upper_y = bound->upper[1],
            .upper_z = bound->upper[2],
        };
        memcpy(elements + (octant * count + place) * (sizeof(element) / sizeof(*elements)), &element,
               sizeof(element));
    }
}
