// SPDX-License-Identifier: MIT
// Moves the fragments without a slot, which arrived in any order, to their texels' places.

#include "ldc/layout.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

uniform uint fragment_count;
uniform uint texel_count;
uniform uint slots;

layout(binding = UNIT_LDC_FRAGMENTS) uniform usamplerBuffer fragments;
layout(binding = UNIT_LDC_PLACES) uniform usamplerBuffer places;
layout(binding = IMAGE_LDC_ORDERED, rg32ui) writeonly uniform uimageBuffer ordered;

void main()
{
    uint k = item_index();
    if (k >= fragment_count)
        return;
    uvec4 fragment = texelFetch(fragments, int(k));
    uint place = slots * texel_count + texelFetch(places, int(fragment.x)).x + (fragment.y - slots);
    imageStore(ordered, int(place), uvec4(fragment.zw, 0u, 0u));
}
