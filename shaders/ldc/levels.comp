// SPDX-License-Identifier: MIT
// Finds the ranges of depth over blocks of texels of an image, with all its layers (paper, section 1.3). A ray whose
// depths do not meet the range hits nothing in the block: a range covers the extended planes of its samples, not only the
// samples.
#include "ldc/layout.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"
#include "ldc/plane.glsl"

// Maximum of samples in a texel whose planes are evaluated; with more, the maximum deviation is assumed. Software GL ends
// an invocation's loops after 65,535 rounds.
const uint PLANES_MAX = 32u;

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer ldc_texels;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer ldc_geometry;
layout(binding = IMAGE_LDC_NODES, rg32f) writeonly uniform imageBuffer ranges;

uniform uint first_texel, first_block; // those of the cube
uniform uint resolution;               // texels along a side of an image
uniform uint row;                      // blocks along a side

vec2 range_of_texel(uint axis, uvec2 place)
{
    uvec4 words = texelFetch(ldc_texels, int(first_texel + (axis * resolution + place.y) * resolution + place.x));
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
}

void main()
{
    uint block = item_index(), of_image = row * row;
    if (block >= 3u * of_image)
        return;
    uint axis = block / of_image, in_image_ = block - axis * of_image;
    uvec2 first = uvec2(in_image_ % row, in_image_ / row) << LDC_BLOCK_SHIFT;
    uvec2 end = min(first + (1u << LDC_BLOCK_SHIFT), uvec2(resolution));
    vec2 range = vec2(LDC_NO_DEPTH, -LDC_NO_DEPTH);
    for (uint v = first.y; v < end.y; v++) {
        for (uint u = first.x; u < end.x; u++) {
            vec2 texel = range_of_texel(axis, uvec2(u, v));
            range = vec2(min(range.x, texel.x), max(range.y, texel.y));
        }
    }
    imageStore(ranges, int(first_block + block), vec4(range, 0.0, 0.0));
}
