// SPDX-License-Identifier: MIT
// Lists the texels that have fragments, in image order, so that neighbours in an image are neighbours in the output.

#include "abuffer/layout.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

uniform uint first_item, end_item; // groups of ABUFFER_OCCUPIED_TEXELS texels

layout(binding = UNIT_ABUFFER_HEADS) uniform usamplerBuffer heads;
layout(binding = IMAGE_ABUFFER_OCCUPIED, r32ui) writeonly uniform uimageBuffer occupied;
layout(std430, binding = BIND_ABUFFER_BUILD_COUNTS) buffer build_block { abuffer_build_counts build; };

void main()
{
    uint item = first_item + item_index(), first = item * ABUFFER_OCCUPIED_TEXELS;
    if (item >= end_item)
        return;
    uint filled = 0u;
    for (uint i = 0u; i < ABUFFER_OCCUPIED_TEXELS; i++)
        filled |= texelFetch(heads, int(first + i)).x != 0u ? 1u << i : 0u;
    if (filled == 0u)
        return;
    uint at = atomicAdd(build.occupied, uint(bitCount(filled)));
    for (; filled != 0u; filled &= filled - 1u)
        imageStore(occupied, int(at++), uvec4(first + uint(findLSB(filled))));
}
