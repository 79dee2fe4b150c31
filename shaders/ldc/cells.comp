// SPDX-License-Identifier: MIT
// Which cells of a cube samples' planes pass, and which samples these are: nodes, blocks and entries of shared/ldc.h.
//
// Defines, one of them:
//   CELLS_BLOCKS   marks the blocks that samples are in; an item is a texel of the images
//   CELLS_PLACE    gives nodes their blocks; an item is a node
//   CELLS_MARK     marks cells; an item is a texel
//   CELLS_COUNT    gives blocks their entries; an item is a block
//   CELLS_FILL     writes entries; an item is a texel
//   CELLS_REACH_X, CELLS_REACH_Y, CELLS_REACH_Z   how far it is empty; an item is a node
#include "shared/bindings.h"
#include "common/dispatch.glsl"
#include "ldc/plane.glsl"

uniform int first_node, grid; // nodes along a side

#if !defined CELLS_REACH_X && !defined CELLS_REACH_Y && !defined CELLS_REACH_Z
layout(std430, binding = BIND_TRACER_0) buffer count_block {
    uint block_count;
    uint entry_count; // a cell's first
    uint further_count; // entries of cells that have one
    uint unused;
    uvec4 lower, upper; // nodes that hold something
} counts;
#endif

#if defined CELLS_BLOCKS || defined CELLS_MARK || defined CELLS_FILL

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer ldc_texels;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer ldc_geometry;
layout(binding = IMAGE_LDC_NODES, r32ui) uniform uimageBuffer nodes; // words

#ifdef CELLS_FILL
layout(binding = IMAGE_LDC_ENTRIES, r32ui) uniform uimageBuffer entries; // words
#endif

uniform int first_texel, resolution;

int node_of(ivec3 cell)
{
    ivec3 n = cell >> LDC_NODE_SHIFT;
    return 4 * (first_node + (n.z * grid + n.y) * grid + n.x);
}

// How many bits of a node's or block's 64 come before one.
uint rank_of(int words, bool upper_half, uint bit)
{
    uint below = uint(bitCount(imageLoad(nodes, upper_half ? words + 1 : words).x & ((1u << bit) - 1u)));
    return upper_half ? below + uint(bitCount(imageLoad(nodes, words).x)) : below;
}

void mark(ivec3 cell, int axis, uint sample_index, uvec2 geometry)
{
    uvec3 b = uvec3(cell);
    int node = node_of(cell);
    uint block_bit = (b.x >> 2 & 3u) | (b.y & 12u) | (b.z & 4u) << 2;
    bool upper_half = (b.z & 8u) != 0u;
    int word = upper_half ? node + 1 : node;
#ifdef CELLS_BLOCKS
    uint bit = 1u << block_bit;
    if ((imageLoad(nodes, word).x & bit) == 0u)
        imageAtomicOr(nodes, word, bit);
#else
    uint rank = rank_of(node, upper_half, block_bit);
    int block = int(4u * (imageLoad(nodes, node + 2).x + rank));
    uint cell_bit = (b.x & 3u) | (b.y & 3u) << 2 | (b.z & 1u) << 4;
    bool upper_cells = (b.z & 2u) != 0u;
#ifdef CELLS_MARK
    uint bit = 1u << cell_bit;
    if ((imageAtomicOr(nodes, upper_cells ? block + 1 : block, bit) & bit) != 0u)
        atomicAdd(counts.further_count, 1u);
#else
    uint entry = imageLoad(nodes, block + 2).x + rank_of(block, upper_cells, cell_bit);
    uint packed_ = sample_index | uint(axis) << LDC_ENTRY_AXIS_SHIFT;
    if (imageAtomicCompSwap(entries, int(4u * entry), LDC_ENTRY_NONE, packed_) != LDC_ENTRY_NONE) {
        uint further = atomicAdd(counts.further_count, 1u);
        uint next = imageAtomicExchange(entries, int(4u * entry + 1u), further);
        imageStore(entries, int(4u * further), uvec4(packed_));
        imageStore(entries, int(4u * further + 1u), uvec4(next));
        entry = further;
    }
    imageStore(entries, int(4u * entry + 2u), uvec4(geometry.x));
    imageStore(entries, int(4u * entry + 3u), uvec4(geometry.y));
#endif
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
#ifdef CELLS_BLOCKS
    int marked = -1; // up to which depth
#endif
    for (uint i = words.x; i < words.x + (words.y & LDC_TEXEL_COUNT_MASK); i++) {
        uvec2 g = texelFetch(ldc_geometry, int(i)).xy;
        float depth = uintBitsToFloat(g.x), reach = plane_reach(g.y, axis);
        int first = int(clamp(depth - reach, 0.0, float(resolution - 1)));
        int last = int(clamp(depth + reach, 0.0, float(resolution - 1)));
#ifdef CELLS_BLOCKS
        first = max(first, marked + 1);
        marked = last;
#endif
        for (int k = first; k <= last; k++)
            mark(axis == 0 ? ivec3(k, u, v) : axis == 1 ? ivec3(v, k, u) : ivec3(u, v, k), axis, i, g);
    }
}

#else

layout(binding = IMAGE_LDC_NODES, rgba32ui) uniform uimageBuffer nodes;

#ifdef CELLS_COUNT

uniform uint first_entry;
uniform int blocks;

void main()
{
    int item = int(item_index());
    if (item >= blocks)
        return;
    int at = first_node + grid * grid * grid + item;
    uvec4 block = imageLoad(nodes, at);
    block.z = first_entry + atomicAdd(counts.entry_count, uint(bitCount(block.x) + bitCount(block.y)));
    imageStore(nodes, at, block);
}

#else

#ifdef CELLS_PLACE

void settle(int at, ivec3 place)
{
    uvec4 node = imageLoad(nodes, at);
    uint count = uint(bitCount(node.x) + bitCount(node.y));
    if (count > 0u) {
        node.z = uint(first_node + grid * grid * grid) + atomicAdd(counts.block_count, count);
        uvec3 at_node = uvec3(place);
        for (int k = 0; k < 3; k++) {
            if (at_node[k] < counts.lower[k])
                atomicMin(counts.lower[k], at_node[k]);
            if (at_node[k] > counts.upper[k])
                atomicMax(counts.upper[k], at_node[k]);
        }
    }
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

#endif
