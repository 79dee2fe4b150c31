// SPDX-License-Identifier: MIT
// First of three passes that give children their places (then compact_scan.comp and compact_move.comp): counts the children and shadow rays of each block of
// COMPACT_BLOCK hits. One invocation per block: no shared memory, which is slow on software GL.

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
    uvec2 sum = uvec2(0u);
    for (uint k = first; k < min(first + COMPACT_BLOCK, wave.hits.count); k++)
        sum += uvec2(child_counts[k] & 3u, child_counts[k] >> 2);
    block_offsets[block] = sum;
}
