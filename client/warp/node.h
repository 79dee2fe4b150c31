/* SPDX-License-Identifier: MIT */
/* Nodes of the quadtrees: their order, and the meaning of their 64 bits, as in shaders/quadtree/node.glsl. */
#ifndef FARLIGHT_CLIENT_WARP_NODE_H
#define FARLIGHT_CLIENT_WARP_NODE_H

#include "warp/lanes.h"

#define NODE_NOTHING 0x80000000u /* the first word of a plane of w = 0 */
#define NODE_W_BITS 0x7ffffffeu
#define NODE_HALF_SIGN 0x8000u
#define NODE_HALF_BITS 0x7fffu
/* Difference of the exponents of floats and half floats, 112. */
#define NODE_HALF_BIAS (112u << 23)
#define NODE_SMALLEST_NORMAL (113u << 23) /* 2^-14 */

/* Index of the first node of a level; `texels` = padded width * height, a multiple of 4^QUADTREE_TOP. The
 * division of a multiple of 3 by 3 is a product. */
LANES_INLINE uint32_t node_level_first(uint32_t texels, uint32_t level)
{
    return (texels - (texels >> 2 * level)) * 0xaaaaaaabu * 4u;
}

/* Rounds to the nearest half float, ties to even; `value` must be in range. */
LANES_INLINE uint32_t half_of(float value)
{
    const uint32_t bits = bits_of(value) & 0x7fffffffu, sign = bits_of(value) >> 16 & NODE_HALF_SIGN;
    const uint32_t normal = (bits + 0xfffu + (bits >> 13 & 1u) - NODE_HALF_BIAS) >> 13;
    /* The last bit of 0.5 has the value of the smallest half float. */
    const uint32_t subnormal = bits_of(float_from_bits(bits) + 0.5f) - bits_of(0.5f);
    return sign | (bits < NODE_SMALLEST_NORMAL ? subnormal : normal);
}

/* Divides by QUADTREE_SLOPE_SCALE as well. */
LANES_INLINE float slope_from_half(uint32_t half)
{
    const float scale = 5.192296858534828e33f / QUADTREE_SLOPE_SCALE; /* 2^112, the difference of the exponents */
    const uint32_t value = bits_of(float_from_bits((half & NODE_HALF_BITS) << 13) * scale);
    return float_from_bits(value | (half & NODE_HALF_SIGN) << 16);
}

LANES_INLINE uint32_t half_of_slope(float slope)
{
    return half_of(clamp(slope * QUADTREE_SLOPE_SCALE, -QUADTREE_SLOPE_MAX, QUADTREE_SLOPE_MAX));
}

LANES_INLINE int node_is_plane(uint32_t head)
{
    return (int32_t)head < 0;
}

LANES_INLINE float plane_w(uint32_t head)
{
    return float_from_bits(head & NODE_W_BITS);
}

LANES_INLINE float plane_slope_x(uint32_t tail)
{
    return slope_from_half(tail);
}

LANES_INLINE float plane_slope_y(uint32_t tail)
{
    return slope_from_half(tail >> 16);
}

LANES_INLINE uint32_t plane_head(float w, uint32_t is_at_edge)
{
    return (bits_of(w) & NODE_W_BITS) | NODE_NOTHING | is_at_edge;
}

LANES_INLINE uint32_t plane_tail(float slope_x, float slope_y)
{
    return half_of_slope(slope_x) | half_of_slope(slope_y) << 16;
}

#endif
