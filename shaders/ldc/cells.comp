// SPDX-License-Identifier: MIT
// Which cells of a cube samples' planes pass: the nodes and blocks of shared/ldc.h, in six passes.
//
// Defines, one of them:
//   CELLS_BLOCKS   marks the blocks that samples are in; an item is a texel of the images
//   CELLS_PLACE    gives nodes their blocks; an item is a node
//   CELLS_MARK     marks cells; an item is a texel
//   CELLS_REACH_X, CELLS_REACH_Y, CELLS_REACH_Z   how far it is empty; an item is a node
#include "shared/bindings.h"
#include "common/dispatch.glsl"
#include "ldc/plane.glsl"

uniform int first_node, grid; // nodes along a side

#if defined CELLS_BLOCKS || defined CELLS_MARK

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer ldc_texels;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer ldc_geometry;
layout(binding = IMAGE_LDC_NODES, r32ui) uniform uimageBuffer nodes; // words

uniform int first_texel, resolution;

void set_bits(int word, uint bits)
{
    if ((imageLoad(nodes, word).x & bits) != bits)
        imageAtomicOr(nodes, word, bits);
}

int node_of(ivec3 cell)
{
    ivec3 n = cell >> LDC_NODE_SHIFT;
    return 4 * (first_node + (n.z * grid + n.y) * grid + n.x);
}

void mark(ivec3 cell, int axis)
{
    uvec3 b = uvec3(cell);
    int node = node_of(cell);
    uint block_bit = (b.x >> 2 & 3u) | (b.y & 12u) | (b.z & 4u) << 2;
    bool upper_half = (b.z & 8u) != 0u;
#ifdef CELLS_BLOCKS
    set_bits(upper_half ? node + 1 : node, 1u << block_bit);
#else
    uint word = imageLoad(nodes, upper_half ? node + 1 : node).x;
    uint rank = uint(bitCount(word & ((1u << block_bit) - 1u)));
    if (upper_half)
        rank += uint(bitCount(imageLoad(nodes, node).x));
    int block = int(4u * (imageLoad(nodes, node + 2).x + 2u * rank));
    uint bit = 1u << ((b.x & 3u) | (b.y & 3u) << 2 | (b.z & 1u) << 4);
    int half_ = int(b.z >> 1 & 1u);
    set_bits(block + half_, bit);
    set_bits(block + 2 + 2 * axis + half_, bit);
#endif
}

void main()
{
    int item = int(item_index()), of_image = resolution * resolution;
    if (item >= 3 * of_image)
        return;
    int axis = item / of_image, in_image_ = item - axis * of_image;
    int v = in_image_ / resolution, u = in_image_ - v * resolution;
    uvec2 words = texelFetch(ldc_texels, first_texel + item).xy;
    int marked = -1; // up to which depth
    for (uint i = words.x; i < words.x + (words.y & LDC_TEXEL_COUNT_MASK); i++) {
        uvec2 g = texelFetch(ldc_geometry, int(i)).xy;
        float depth = uintBitsToFloat(g.x), reach = plane_reach(g.y, axis);
        int first = int(clamp(depth - reach, 0.0, float(resolution - 1)));
        int last = int(clamp(depth + reach, 0.0, float(resolution - 1)));
        for (int k = max(first, marked + 1); k <= last; k++)
            mark(axis == 0 ? ivec3(k, u, v) : axis == 1 ? ivec3(v, k, u) : ivec3(u, v, k), axis);
        marked = last;
    }
}

#else

layout(binding = IMAGE_LDC_NODES, rgba32ui) uniform uimageBuffer nodes;

#ifdef CELLS_PLACE

layout(std430, binding = BIND_TRACER_0) buffer count_block { uint blocks_placed; };

void settle(int at, ivec3 place)
{
    uvec4 node = imageLoad(nodes, at);
    uint count = uint(bitCount(node.x) + bitCount(node.y));
    if (count > 0u)
        node.z = uint(first_node + grid * grid * grid) + 2u * atomicAdd(blocks_placed, count);
    imageStore(nodes, at, node);
}

#else

// How many nodes from this one on, one way along an axis, are empty, squares, cubes of them: as many as each of so many
// rows, squares beside it has. A node's own words are written by no other invocation.
uint reach(int at, int left, int step_, int shift)
{
    uint count = LDC_NODE_FAR;
    for (uint k = 0u; k < count; k++) {
        // Beyond the grid all is empty.
        uint beside = LDC_NODE_FAR;
        if (int(k) < left) {
            uvec4 node = imageLoad(nodes, at + int(k) * step_);
#ifdef CELLS_REACH_X
            beside = (node.x | node.y) == 0u ? LDC_NODE_FAR : 0u;
#else
            beside = node.w >> shift & LDC_NODE_FAR;
#endif
        }
        count = min(count, max(beside, k));
    }
    return count;
}

void settle(int at, ivec3 place)
{
    uvec4 node = imageLoad(nodes, at);
    bool is_empty = (node.x | node.y) == 0u;
    uint bits = 0u;
#ifdef CELLS_REACH_X
    if (is_empty)
        bits = reach(at, grid - place.x, 1, 0) | reach(at, place.x + 1, -1, 0) << 4;
    node.w = bits;
#elif defined CELLS_REACH_Y
    if (is_empty)
        for (int octant = 0; octant < 4; octant++)
            bits |= reach(at, octant < 2 ? grid - place.y : place.y + 1, octant < 2 ? grid : -grid, 4 * (octant & 1))
                    << 4 * octant;
    node.w |= bits << 8;
#else
    if (is_empty) {
        for (int octant = 0; octant < 8; octant++)
            bits |= reach(at, octant < 4 ? grid - place.z : place.z + 1, octant < 4 ? grid * grid : -grid * grid,
                          8 + 4 * (octant & 3))
                    << 4 * octant;
        node.z = bits;
    }
#endif
    imageStore(nodes, at, node);
}

#endif

void main()
{
    int item = int(item_index());
    if (item >= grid * grid * grid)
        return;
    settle(first_node + item, ivec3(item % grid, item / grid % grid, item / (grid * grid)));
}

#endif
