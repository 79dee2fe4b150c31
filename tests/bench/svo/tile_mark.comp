// SPDX-License-Identifier: MIT
// One level of nodes: each fragment says of that which it is in that it holds something.
#include "common/dispatch.glsl"
#include "svo/tiles.glsl"

layout(binding = UNIT_SVO_FRAGMENTS) uniform usamplerBuffer fragments;
layout(binding = IMAGE_SVO_RECORDS, r32ui) writeonly uniform uimageBuffer nodes;

uniform uint fragment_count;
uniform int levels, level;

void main()
{
    int k = int(item_index());
    if (uint(k) < fragment_count)
        imageStore(nodes, node_of(unpack_cell(texelFetch(fragments, k).x), levels, level), uvec4(SVO_HOLDS));
}
