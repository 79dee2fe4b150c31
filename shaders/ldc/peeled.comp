// SPDX-License-Identifier: MIT
// Notes a layer that was peeled off the scene with its texels, behind those before it.

#include "shared/ldc_build.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

uniform uint texel_count;
uniform uint texels_along;
uniform uint layer; // 0, 1, ..

layout(binding = UNIT_LDC_COUNTS) uniform usamplerBuffer counts;
layout(binding = UNIT_LDC_PLACES) uniform usamplerBuffer places;
layout(binding = UNIT_LDC_LAYER) uniform usampler2DArray peeled; // depth, id
layout(binding = IMAGE_LDC_ORDERED, rg32ui) writeonly uniform uimageBuffer ordered;
layout(binding = IMAGE_LDC_FOUND, r32ui) writeonly uniform uimageBuffer found;

void main()
{
    uint texel = item_index();
    if (texel >= texel_count || texelFetch(counts, int(texel)).x <= layer)
        return;
    uint row = texel / texels_along, axis = row / texels_along;
    uvec2 fragment = texelFetch(peeled, ivec3(texel - row * texels_along, row - axis * texels_along, axis), 0).xy;
    if (fragment.y == LDC_NO_ID)
        return;
    imageStore(ordered, int(texelFetch(places, int(texel)).x + layer), uvec4(fragment, 0u, 0u));
    imageStore(found, int(texel), uvec4(layer + 1u));
}
