// SPDX-License-Identifier: MIT
// Notes a layer that was peeled off the scene with its texels, behind those before it.

#include "shared/ldc_build.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

uniform uint occupied_count;
uniform uint texels_along; // a side of the images
uniform uint layer;        // 0, 1, ..

layout(binding = UNIT_LDC_OCCUPIED) uniform usamplerBuffer occupied;
layout(binding = UNIT_LDC_PLACES) uniform usamplerBuffer places;
layout(binding = UNIT_LDC_LAYER) uniform usampler2DArray peeled; // depth, id
layout(binding = IMAGE_LDC_ORDERED, rg32ui) writeonly uniform uimageBuffer ordered;
layout(binding = IMAGE_LDC_FOUND, r32ui) writeonly uniform uimageBuffer found;

void main()
{
    uint k = item_index();
    if (k >= occupied_count)
        return;
    uint bits = texelFetch(occupied, int(k)).x, u = bits & 4095u, v = bits >> 12 & 4095u, axis = bits >> 24;
    uvec2 fragment = texelFetch(peeled, ivec3(u, v, axis), 0).xy;
    if (fragment.y == LDC_NO_ID)
        return;
    int texel = int((axis * texels_along + v) * texels_along + u);
    imageStore(ordered, int(texelFetch(places, texel).x + layer), uvec4(fragment, 0u, 0u));
    imageStore(found, texel, uvec4(layer + 1u));
}
