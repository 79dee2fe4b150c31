// SPDX-License-Identifier: MIT
// Finds the size of the empty space round the empty blocks of a grid (raster/layout.h). One invocation per block.
// Defines, one per pass, in this order: REACH_X, REACH_Y, REACH_Z.
#include "raster/layout.h"
#include "common/dispatch.glsl"

layout(binding = IMAGE_BLOCKS, rgba32ui) uniform uimageBuffer blocks;

uniform int first_texel, block_texels, grid; // first texel of the grid; texels of a block; blocks along a side
uniform uint first_item, end_item;           // blocks of the dispatch

// Number of empty blocks from this one on in one direction of an axis; then of empty squares, then of cubes: the largest
// n for which n adjacent rows (squares) are empty over n. It is found for up to four octants at once, whose 4 bits begin
// at `shift`. No other invocation writes a block's own words.
uint reach(int at, int left, int step_, uint shift)
{
    uvec4 counts = uvec4(BLOCK_REACH_MAX);
    for (uint k = 0u; any(greaterThan(counts, uvec4(k))); k++) {
        // Everything beyond the grid is empty.
        uvec4 beside = uvec4(BLOCK_REACH_MAX);
        if (int(k) < left) {
            uvec4 block = imageLoad(blocks, at + int(k) * step_);
#ifdef REACH_X
            beside = uvec4((block.x | block.y) == 0u ? BLOCK_REACH_MAX : 0u);
#else
            beside = uvec4(block.w) >> (shift + uvec4(0u, 4u, 8u, 12u)) & BLOCK_REACH_MAX;
#endif
        }
        counts = min(counts, max(beside, uvec4(k)));
    }
    return counts.x | counts.y << 4 | counts.z << 8 | counts.w << 12;
}

void settle(int at, ivec3 place)
{
    uvec4 block = imageLoad(blocks, at);
    bool is_empty = (block.x | block.y) == 0u;
    int row = block_texels * grid;
#ifdef REACH_X
    block.w = is_empty ? (reach(at, grid - place.x, block_texels, 0u) & 0xfu) |
                             (reach(at, place.x + 1, -block_texels, 0u) & 0xfu) << 4
                       : 0u;
#elif defined REACH_Y
    if (is_empty)
        block.w |= (reach(at, grid - place.y, row, 0u) & 0xffu) << 8 | (reach(at, place.y + 1, -row, 0u) & 0xffu) << 16;
#else
    if (is_empty)
        block.z = reach(at, grid - place.z, row * grid, 8u) | reach(at, place.z + 1, -row * grid, 8u) << 16;
#endif
    imageStore(blocks, at, block);
}

void main()
{
    uint item = first_item + item_index();
    if (item >= end_item)
        return;
    int block = int(item);
    settle(first_texel + block_texels * block, ivec3(block % grid, block / grid % grid, block / (grid * grid)));
}
