// SPDX-License-Identifier: MIT
// From the fragments of texels to their samples: sorted by depth and id, the first of coincident ones, the nearest of
// more than may be kept. Writes texels and quads, and what sample.comp needs to know of each sample.
// Define: PEELED  they are sorted already, each once

#include "shared/ldc.h"
#include "shared/ldc_build.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

uniform uint texel_count;
uniform uint first_texel, first_sample, first_quad; // of the cube
uniform uint layers_max;                            // at most 255

layout(binding = UNIT_LDC_COUNTS) uniform usamplerBuffer counts;
layout(binding = UNIT_LDC_PLACES) uniform usamplerBuffer places;
#ifdef PEELED
layout(binding = UNIT_LDC_FOUND) uniform usamplerBuffer found;
#endif
layout(binding = IMAGE_LDC_ORDERED, rg32ui) uniform uimageBuffer ordered;
layout(binding = IMAGE_LDC_TEXELS, rgba32ui) writeonly uniform uimageBuffer texels_out;
layout(binding = IMAGE_LDC_QUADS, rgba32f) writeonly uniform imageBuffer quads_out;
layout(binding = IMAGE_LDC_VISIBLE, rgba32ui) writeonly uniform uimageBuffer visible;
layout(std430, binding = BIND_LDC_BUILD_COUNTS) buffer build_block { ldc_build_counts build; };

bool before(uvec2 a, uvec2 b)
{
    return a.x < b.x || a.x == b.x && a.y < b.y; // depths are not negative: their bits ascend as they do
}

#ifndef PEELED
void sort(uint place, uint count)
{
    for (uint i = 1u; i < count; i++) {
        uvec2 moved = imageLoad(ordered, int(place + i)).xy;
        uint k = i;
        for (; k > 0u; k--) {
            uvec2 above = imageLoad(ordered, int(place + k - 1u)).xy;
            if (!before(moved, above))
                break;
            imageStore(ordered, int(place + k), uvec4(above, 0u, 0u));
        }
        imageStore(ordered, int(place + k), uvec4(moved, 0u, 0u));
    }
}

// Those that stay, moved together; their number.
uint keep(uint place, uint count)
{
    uint kept = 0u, last = LDC_NO_DEPTH_BITS;
    for (uint i = 0u; i < count && kept < layers_max; i++) {
        uvec2 own = imageLoad(ordered, int(place + i)).xy;
        if (own.x == last)
            continue;
        last = own.x;
        if (kept != i)
            imageStore(ordered, int(place + kept), uvec4(own, 0u, 0u));
        kept++;
    }
    return kept;
}
#endif

void main()
{
    uint begin = item_index() * LDC_PACK_TEXELS;
    if (begin >= texel_count)
        return;
    uint end = begin + LDC_PACK_TEXELS < texel_count ? begin + LDC_PACK_TEXELS : texel_count;
    uvec2 kept = uvec2(0u); // eight numbers of a byte
    uint samples = 0u, quads = 0u;
    for (uint texel = begin; texel < end; texel++) {
        uint count = texelFetch(counts, int(texel)).x, place = texelFetch(places, int(texel)).x;
        uint shift = (texel & 3u) * 8u;
#ifdef PEELED
        uint own = texelFetch(found, int(texel)).x;
#else
        sort(place, count);
        uint own = keep(place, count);
#endif
        samples += own;
        quads += (own + 3u) >> 2;
        if ((texel & 4u) == 0u)
            kept.x |= own << shift;
        else
            kept.y |= own << shift;
        if (own == layers_max && count > own)
            atomicAdd(build.samples_lost, count - own);
    }
    uint sample_ = first_sample, quad = first_quad;
    if (samples > 0u) {
        sample_ += atomicAdd(build.samples, samples);
        quad += atomicAdd(build.quads, quads);
    }
    for (uint texel = begin; texel < end; texel++) {
        uint own = ((texel & 4u) == 0u ? kept.x : kept.y) >> (texel & 3u) * 8u & 255u;
        uint place = texelFetch(places, int(texel)).x;
        vec2 range = vec2(LDC_NO_DEPTH, -LDC_NO_DEPTH);
        uvec4 texel_out = uvec4(sample_, quad << LDC_TEXEL_QUAD_SHIFT | own, 0u, 0u);
        for (uint i = 0u; i < own; i += 4u) {
            vec4 depths = vec4(LDC_NO_DEPTH);
            for (uint k = 0u; k < 4u; k++) {
                if (i + k >= own)
                    break;
                uvec2 fragment = imageLoad(ordered, int(place + i + k)).xy;
                float depth = uintBitsToFloat(fragment.x);
                depths[k] = depth;
                range = vec2(i + k == 0u ? depth : range.x, depth);
                imageStore(visible, int(sample_ - first_sample), uvec4(texel, fragment, 0u));
                sample_++;
            }
            imageStore(quads_out, int(quad), depths);
            quad++;
        }
        texel_out.zw = floatBitsToUint(range);
        if (own == 0u)
            texel_out.xy = uvec2(0u);
        imageStore(texels_out, int(first_texel + texel), texel_out);
    }
}
