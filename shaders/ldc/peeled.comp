// SPDX-License-Identifier: MIT
// Appends a peeled layer of the scene to its texels' records. A texel has as many places as fragments were counted in it:
// fragments that another program draws beyond them are lost, and counted as lost.

#include "ldc/layout.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

uniform uint occupied_count;
uniform uint texels_along; // a side of the images
uniform uint layer;        // 0, 1, ..

layout(binding = UNIT_LDC_OCCUPIED) uniform usamplerBuffer occupied;
layout(binding = UNIT_LDC_COUNTS) uniform usamplerBuffer counts;
layout(binding = UNIT_LDC_PLACES) uniform usamplerBuffer places;
layout(binding = UNIT_LDC_LAYER) uniform usampler2DArray layer_geometry;
layout(binding = UNIT_LDC_LAYER_SURFACE) uniform usampler2DArray layer_surface;
layout(binding = IMAGE_LDC_ORDERED, rg32ui) writeonly uniform uimageBuffer ordered;
layout(binding = IMAGE_LDC_PEELED_SURFACE, rgba32ui) writeonly uniform uimageBuffer peeled;
layout(binding = IMAGE_LDC_FOUND, r32ui) writeonly uniform uimageBuffer found;
layout(std430, binding = BIND_LDC_BUILD_COUNTS) buffer build_block { ldc_build_counts build; };

void main()
{
    uint k = item_index();
    if (k >= occupied_count)
        return;
    uint bits = texelFetch(occupied, int(k)).x, u = bits & 4095u, v = bits >> 12 & 4095u, axis = bits >> 24;
    uvec4 words = texelFetch(layer_geometry, ivec3(u, v, axis), 0);
    if (words.x == LDC_NO_DEPTH_BITS)
        return;
    int texel = int((axis * texels_along + v) * texels_along + u), place = int(texelFetch(places, texel).x + layer);
    if (layer >= texelFetch(counts, texel).x) {
        atomicAdd(build.samples_lost, 1u);
        return;
    }
    imageStore(ordered, place, uvec4(words.xy, 0u, 0u));
    imageStore(peeled, 2 * place, texelFetch(layer_surface, ivec3(u, v, axis), 0));
    imageStore(peeled, 2 * place + 1, uvec4(words.zw, 0u, 0u));
    imageStore(found, texel, uvec4(layer + 1u));
}
