// SPDX-License-Identifier: MIT
// One level of records: each fragment goes on from the record that it has come to, and marks where in the next it lies.
// Define: SVO_TOP  the first level, of the root alone
#include "common/dispatch.glsl"
#include "svo/tree.glsl"

layout(binding = UNIT_SVO_FRAGMENTS) uniform usamplerBuffer fragments;
layout(std430, binding = BIND_SVO_MARKS) buffer marks_block { uint marks[]; };
layout(binding = IMAGE_SVO_CURRENT, r32ui) uniform uimageBuffer current;

uniform uint fragment_count;
uniform int shift; // of what the records are marked with: cells of 2^shift

void main()
{
    int k = int(item_index());
    if (uint(k) >= fragment_count)
        return;
    ivec3 cell = unpack_cell(texelFetch(fragments, k).x);
    int place = 0, bit;
    bool is_high;
#ifndef SVO_TOP
    bit = grandchild_of(cell, shift + 2, is_high);
    place = child_place(texelFetch(records, int(imageLoad(current, k).x)), bit, is_high);
#endif
    imageStore(current, k, uvec4(place));
    bit = grandchild_of(cell, shift, is_high);
    uvec4 record = texelFetch(records, place);
    // Most find that another one was there before. Who sees it too late only says it again.
    if ((((is_high ? record.y : record.x) >> bit) & 1u) == 0u)
        atomicOr(marks[4 * place + (is_high ? 1 : 0)], 1u << bit);
}
