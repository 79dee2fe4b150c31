// SPDX-License-Identifier: MIT
// Ranges of depth over blocks of texels of an image, of all its layers: one level from the one below (paper, section
// 1.3). A ray whose depths do not meet the range hits nothing in the block: a range covers the extended planes of its
// samples, not only the samples.
//
// Defines: LDC_FROM_TEXELS the level below is that of the texels; LDC_LEVEL_BITS.
#include "ldc/layout.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"
#include "ldc/plane.glsl"

#ifdef LDC_FROM_TEXELS
// The number of a texel's samples whose planes are evaluated; with more, the maximum deviation is assumed. Software GL
// ends an invocation's loops after 65,535 rounds, and the largest block has 1,024 texels.
const uint PLANES_MAX = 32u;

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer ldc_texels;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer ldc_geometry;
#else
layout(binding = UNIT_TRACER_0) uniform samplerBuffer ranges_below;
#endif
layout(binding = IMAGE_LDC_NODES, rg32f) writeonly uniform imageBuffer ranges;

uniform uint first_below, row_below, width_below, image_below; // where an image's level below begins; row and image are
uniform uint first_here, row_here, width_here, image_here;     // strides; width: nodes in a row

vec2 range_below(uint axis, uvec2 place)
{
    int at = int(first_below + axis * image_below + place.y * row_below + place.x);
#ifdef LDC_FROM_TEXELS
    uvec4 words = texelFetch(ldc_texels, at);
    uint count = words.y & LDC_TEXEL_COUNT_MASK;
    if (count > PLANES_MAX)
        return uintBitsToFloat(words.zw) + vec2(-LDC_SPAN - LDC_ROUNDING, LDC_SPAN + LDC_ROUNDING);
    vec2 range = vec2(LDC_NO_DEPTH, -LDC_NO_DEPTH);
    for (uint i = words.x; i < words.x + count; i++) {
        uvec2 g = texelFetch(ldc_geometry, int(i)).xy;
        float depth = uintBitsToFloat(g.x), reach = plane_reach(g.y, int(axis));
        range = vec2(min(range.x, depth - reach), max(range.y, depth + reach));
    }
    return range;
#else
    return texelFetch(ranges_below, at).xy;
#endif
}

void main()
{
    uint item = item_index();
    uint of_image = width_here * width_here;
    if (item >= 3u * of_image)
        return;
    uint axis = item / of_image, in_image_ = item - axis * of_image;
    uvec2 place = uvec2(in_image_ % width_here, in_image_ / width_here);
    uvec2 first = place << LDC_LEVEL_BITS;
    uvec2 end = min(first + (1u << LDC_LEVEL_BITS), uvec2(width_below));
    vec2 range = vec2(LDC_NO_DEPTH, -LDC_NO_DEPTH);
    for (uint v = first.y; v < end.y; v++) {
        for (uint u = first.x; u < end.x; u++) {
            vec2 below = range_below(axis, uvec2(u, v));
            range = vec2(min(range.x, below.x), max(range.y, below.y));
        }
    }
    imageStore(ranges, int(first_here + axis * image_here + place.y * row_here + place.x), vec4(range, 0.0, 0.0));
}
