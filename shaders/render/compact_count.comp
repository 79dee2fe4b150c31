// SPDX-License-Identifier: MIT
// First of three passes that give children their places (compact_scan.comp and compact_move.comp follow): counts the
// children and shadow rays of each block of COMPACT_BLOCK hits, in a sorted wave those of each octant. One invocation per
// block: no shared memory, which is slow on software GL.

#include "shared/path.h"
#include "common/dispatch.glsl"
#include "render/wave.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = BIND_CHILD_COUNTS) readonly buffer count_block { uint child_counts[]; };
layout(std430, binding = BIND_BLOCK_OFFSETS) writeonly buffer offset_block { uvec2 block_offsets[]; };

void main()
{
    uint block = item_index(), first = block * COMPACT_BLOCK;
    if (first >= wave.hits.count)
        return;
    uint end = min(first + COMPACT_BLOCK, wave.hits.count);
    uvec2 sum = uvec2(0u), octants = uvec2(0u); // counts per octant, a byte each
    if (wave.sorted == 0u) {
        for (uint k = first; k < end; k++)
            sum += uvec2(child_counts[k] & CHILDREN_MASK, child_counts[k] >> SHADOW_RAYS_SHIFT);
        block_offsets[block] = sum;
        return;
    }
    for (uint k = first; k < end; k++) {
        uint own = child_counts[k], children = own & CHILDREN_MASK, octant = own >> CHILD_OCTANT_SHIFT & OCTANTS - 1u;
        children <<= octant % 4u * 8u;
        octants += octant < 4u ? uvec2(children, 0u) : uvec2(0u, children);
        sum.y += own >> SHADOW_RAYS_SHIFT;
    }
    for (uint octant = 0u; octant < OCTANTS; octant++) {
        uint children = (octant < 4u ? octants.x : octants.y) >> octant % 4u * 8u & 0xffu;
        block_offsets[octant * wave.hit_blocks.count + block] = uvec2(children, octant == 0u ? sum.y : 0u);
    }
}
