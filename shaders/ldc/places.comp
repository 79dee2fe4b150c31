// SPDX-License-Identifier: MIT
// Where each texel's fragments are to lie: places in `ordered`, those of neighbouring texels side by side.

#include "shared/ldc_build.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

uniform uint texel_count;
uniform uint fragments_kept; // of one texel

layout(binding = UNIT_LDC_COUNTS) uniform usamplerBuffer counts;
layout(binding = IMAGE_LDC_PLACES, r32ui) writeonly uniform uimageBuffer places;
layout(std430, binding = BIND_LDC_BUILD_COUNTS) buffer build_block { ldc_build_counts build; };


void main()
{
    uint first = item_index() * LDC_PLACES_TEXELS;
    if (first >= texel_count)
        return;
    uint end = first + LDC_PLACES_TEXELS < texel_count ? first + LDC_PLACES_TEXELS : texel_count, sum = 0u, most = 0u;
    for (uint texel = first; texel < end; texel++) {
        uint count = texelFetch(counts, int(texel)).x;
        sum += count < fragments_kept ? count : fragments_kept;
        most = count > most ? count : most;
    }
    if (sum == 0u)
        return;
    uint place = atomicAdd(build.places, sum);
    if (most > build.layers_needed) // rarely; the atomic is dear
        atomicMax(build.layers_needed, most);
    for (uint texel = first; texel < end; texel++) {
        imageStore(places, int(texel), uvec4(place));
        uint count = texelFetch(counts, int(texel)).x;
        place += count < fragments_kept ? count : fragments_kept;
    }
}
