// SPDX-License-Identifier: MIT
// Lists the paths that hit something, in their order, and writes into each path its place in that list.

#include "shared/hit.h"
#include "shared/path.h"
#include "common/dispatch.glsl"
#include "render/wave.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = BIND_HITS) readonly buffer hit_block { hit hits[]; };
layout(std430, binding = BIND_BLOCK_OFFSETS) readonly buffer offset_block { uvec2 block_offsets[]; };
layout(std430, binding = BIND_HIT_LIST) writeonly buffer list_block { uint hit_list[]; };
layout(std430, binding = BIND_HIT_PLACES) writeonly buffer place_block { uint hit_places[]; };

void main()
{
    uint block = item_index(), first = block * COMPACT_BLOCK;
    if (first >= wave.rays.count)
        return;
    uint place = block_offsets[block].x;
    for (uint k = first; k < min(first + COMPACT_BLOCK, wave.rays.count); k++) {
        bool is_hit = hits[k].distance >= 0.0;
        hit_places[k] = is_hit ? place : HIT_PLACE_NONE;
        if (is_hit)
            hit_list[place++] = k;
    }
}
