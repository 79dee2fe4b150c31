// SPDX-License-Identifier: MIT
// Primitives of the current batch: rayspace/layout.h, RAYSPACE_ITEM_TEXELS.
//
// Defines: RAYSPACE_FLAT there are batches.
#include "rayspace/meet.glsl"

#ifdef RAYSPACE_FLAT

layout(binding = UNIT_RAYSPACE_ITEMS) uniform usamplerBuffer items;

bounds bounds_of_item(uint item)
{
    int texel = int(item) * RAYSPACE_ITEM_TEXELS;
    vec4 sphere = uintBitsToFloat(texelFetch(items, texel));
    return bounds(sphere.xyz, sphere.w, uintBitsToFloat(texelFetch(items, texel + 1).xyz),
                  uintBitsToFloat(texelFetch(items, texel + 2).xyz));
}

uint instance_of_item(uint item)
{
    return texelFetch(items, int(item) * RAYSPACE_ITEM_TEXELS + 1).w;
}

uint number_of_item(uint item)
{
    return texelFetch(items, int(item) * RAYSPACE_ITEM_TEXELS + 2).w;
}

#endif
