// SPDX-License-Identifier: MIT
// Lists the texels that have fragments, counts the fragments, and places those without a slot.

#include "ldc/layout.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

uniform uint texel_count;
uniform uint texels_along; // a side of the images
uniform uint slots;          // fragments of a texel that have a slot
uniform uint fragments_kept; // maximum in a texel

layout(binding = UNIT_LDC_COUNTS) uniform usamplerBuffer counts;
layout(binding = IMAGE_LDC_PLACES, r32ui) writeonly uniform uimageBuffer places;
layout(binding = IMAGE_LDC_OCCUPIED, r32ui) writeonly uniform uimageBuffer occupied;
layout(std430, binding = BIND_LDC_BUILD_COUNTS) buffer build_block { ldc_build_counts build; };

void main()
{
    uint first = item_index() * LDC_PLACES_TEXELS;
    if (first >= texel_count)
        return;
    uint end = first + LDC_PLACES_TEXELS < texel_count ? first + LDC_PLACES_TEXELS : texel_count;
    uint sum = 0u, maximum = 0u, filled = 0u, kept = 0u, quads = 0u, deep = 0u;
    for (uint texel = first; texel < end; texel++) {
        uint count = texelFetch(counts, int(texel)).x;
        uint own = count < fragments_kept ? count : fragments_kept;
        sum += count;
        maximum = count > maximum ? count : maximum;
        filled += count > 0u ? 1u : 0u;
        kept += own;
        quads += (own + 3u) >> 2;
        deep += own > slots ? own - slots : 0u;
    }
    if (sum == 0u)
        return;
    if (atomicAdd(build.fragments, sum) > 0xffffffffu - sum)
        atomicAdd(build.fragments_wraps, 1u);
    atomicAdd(build.samples_max, kept);
    atomicAdd(build.quads_max, quads);
    if (maximum > build.layers_needed) // rare, so the atomic's cost does not matter
        atomicMax(build.layers_needed, maximum);
    uint at = atomicAdd(build.occupied, filled), place = deep > 0u ? atomicAdd(build.places, deep) : 0u;
    uint row = first / texels_along, u = first - row * texels_along, axis = row / texels_along;
    uint bits = axis << 24 | row - axis * texels_along << 12;
    for (uint texel = first; texel < end; texel++) {
        uint count = texelFetch(counts, int(texel)).x;
        if (count > 0u)
            imageStore(occupied, int(at++), uvec4(bits | u));
        u++;
        if (u == texels_along) {
            u = 0u;
            row = bits >> 12 & 4095u;
            bits = row + 1u < texels_along ? bits + 4096u : (bits >> 24) + 1u << 24;
        }
        uint own = count < fragments_kept ? count : fragments_kept;
        if (own > slots) {
            imageStore(places, int(texel), uvec4(place));
            place += own - slots;
        }
    }
}
