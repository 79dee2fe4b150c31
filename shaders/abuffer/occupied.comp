// SPDX-License-Identifier: MIT
// Which texels have lists.

#include "shared/abuffer_build.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

uniform uint texel_count;

layout(binding = UNIT_ABUFFER_HEADS) uniform usamplerBuffer heads;
layout(binding = IMAGE_ABUFFER_OCCUPIED, r32ui) writeonly uniform uimageBuffer occupied;
layout(std430, binding = BIND_ABUFFER_BUILD_COUNTS) buffer build_block { abuffer_build_counts build; };

void main()
{
    uint first = item_index() * ABUFFER_OCCUPIED_TEXELS;
    if (first >= texel_count)
        return;
    uint end = first + ABUFFER_OCCUPIED_TEXELS < texel_count ? first + ABUFFER_OCCUPIED_TEXELS : texel_count;
    uint filled = 0u;
    for (uint texel = first; texel < end; texel++)
        filled += texelFetch(heads, int(texel)).x != 0u ? 1u : 0u;
    if (filled == 0u)
        return;
    uint at = atomicAdd(build.occupied, filled);
    for (uint texel = first; texel < end; texel++)
        if (texelFetch(heads, int(texel)).x != 0u)
            imageStore(occupied, int(at++), uvec4(texel));
}
