// SPDX-License-Identifier: MIT
// Counts the paths of each block of COMPACT_BLOCK that hit something. First of three passes (compact_scan.comp and
// hit_list.comp follow) that list the hits, so that shading runs on these alone: software GL would also execute it for
// paths that left the scene.

#include "shared/hit.h"
#include "shared/path.h"
#include "common/dispatch.glsl"
#include "render/wave.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = BIND_HITS) readonly buffer hit_block { hit hits[]; };
layout(std430, binding = BIND_BLOCK_OFFSETS) writeonly buffer offset_block { uvec2 block_offsets[]; };

void main()
{
    uint block = item_index(), first = block * COMPACT_BLOCK;
    if (first >= wave.rays.count)
        return;
    uint count = 0u;
    for (uint k = first; k < min(first + COMPACT_BLOCK, wave.rays.count); k++)
        count += hits[k].distance >= 0.0 ? 1u : 0u;
    block_offsets[block] = uvec2(count, 0u);
}
