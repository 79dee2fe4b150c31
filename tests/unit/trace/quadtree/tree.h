/* SPDX-License-Identifier: MIT */
/* The nodes of quadtrees for C: what shaders/quadtree/node.glsl is for GLSL, of nodes that were read back. */
#ifndef FARLIGHT_TESTS_QUADTREE_TREE_H
#define FARLIGHT_TESTS_QUADTREE_TREE_H

#include "quadtree/layout.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

struct tree_plane {
    double w, slope_x, slope_y; /* at the node's centre; per texel */
    bool at_edge;
};
struct tree_box {
    double w_max, w_min;
    bool has_gaps;
    double w_least; /* minimum w of surfaces */
};

static inline double tree_float(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof(value));
    return value;
}

/* Value of a finite half float. */
static inline double tree_half(uint32_t bits)
{
    const int exponent = bits >> 10 & 31, fraction = bits & 1023;
    const double size = exponent ? ldexp(1024 + fraction, exponent - 25) : ldexp(fraction, -24);
    return bits & 0x8000 ? -size : size;
}

static inline bool tree_is_plane(const uint32_t node[2])
{
    return node[0] >> 31;
}

static inline struct tree_plane tree_plane_of(const uint32_t node[2])
{
    return (struct tree_plane){.w = tree_float(node[0] & 0x7ffffffe),
                               .slope_x = tree_half(node[1] & 0xffff) / QUADTREE_SLOPE_SCALE,
                               .slope_y = tree_half(node[1] >> 16) / QUADTREE_SLOPE_SCALE,
                               .at_edge = node[0] & 1};
}

static inline struct tree_box tree_box_of(const uint32_t node[2])
{
    const bool has_gaps = node[1] >> 31;
    const double least = tree_float(node[1] & 0x7fffffff);
    return (struct tree_box){tree_float(node[0]), has_gaps ? 0 : least, has_gaps, least};
}

static inline uint32_t tree_level_first(const struct quadtree_uniforms *u, uint32_t level)
{
    uint32_t first = 0;
    for (uint32_t below = 0; below < level; below++)
        first += (u->padded_width >> below) * (u->padded_height >> below);
    return first;
}

static inline uint32_t tree_index(const struct quadtree_uniforms *u, uint32_t slice, uint32_t level, uint32_t x,
                                  uint32_t y)
{
    return slice * u->slice_nodes + tree_level_first(u, level) + y * (u->padded_width >> level) + x;
}

/* Value of a plane at texel coordinates, for node (i, j) of the level. */
static inline double tree_plane_at(const struct tree_plane *plane, uint32_t level, uint32_t i, uint32_t j,
                                   double x, double y)
{
    const double side = (double)(1u << level);
    return plane->w + plane->slope_x * (x - (i + 0.5) * side) + plane->slope_y * (y - (j + 0.5) * side);
}

/* The plane that stands for a texel, and its level: the first from the top down. */
static inline uint32_t tree_find(const struct quadtree_uniforms *u, const uint32_t (*nodes)[2], uint32_t slice,
                                 uint32_t x, uint32_t y, struct tree_plane *plane)
{
    uint32_t level = QUADTREE_TOP;
    while (level > 0 && !tree_is_plane(nodes[tree_index(u, slice, level, x >> level, y >> level)]))
        level--;
    *plane = tree_plane_of(nodes[tree_index(u, slice, level, x >> level, y >> level)]);
    return level;
}

#endif
