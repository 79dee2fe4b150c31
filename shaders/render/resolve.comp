// SPDX-License-Identifier: MIT
// Converts sums of samples to pixels of the output's format, rows from the top. Linear formats are premultiplied by
// alpha, RGBA8 is straight, tone-mapped and sRGB. Attachments: depth unchanged, normals as unit vectors in 8 bits, shares
// too.

// The host sets the define FORMAT to one of those below: software GL would execute all of them for each pixel.

#include "shared/path.h"
#include "common/dispatch.glsl"
#include "render/display.glsl"

#define FORMAT_RGBA8 0
#define FORMAT_RGBA16F 1
#define FORMAT_RGBA32F 2
#define FORMAT_DEPTH32F 3
#define FORMAT_NORMAL8 4
#define FORMAT_SHARE8 5

uniform uint pixel_count; // pixels of the band

layout(std430, binding = BIND_RESOLVED) writeonly buffer resolved_block { uint resolved[]; };

const float HALF_MAX = 65504.0;

void main()
{
    uint k = item_index();
    if (k >= pixel_count)
        return;
    uvec2 pixel = uvec2(k % frame.width, k / frame.width);
    vec4 sum = sum_of_pixel(pixel), colour = mean_of_sum(sum, pixel);
#if FORMAT == FORMAT_RGBA8
    resolved[k] = packUnorm4x8(display_of_sum(colour));
#elif FORMAT == FORMAT_RGBA16F
    colour = min(over_background(colour), vec4(HALF_MAX));
    resolved[2u * k] = packHalf2x16(colour.rg);
    resolved[2u * k + 1u] = packHalf2x16(colour.ba);
#elif FORMAT == FORMAT_RGBA32F
    colour = over_background(colour);
    for (int i = 0; i < 4; i++)
        resolved[4u * k + uint(i)] = floatBitsToUint(colour[i]);
#elif FORMAT == FORMAT_DEPTH32F
    resolved[k] = floatBitsToUint(sum.r);
#elif FORMAT == FORMAT_NORMAL8
    float extent = length(sum.xyz); // 0 also where normals cancel out
    vec3 normal = extent > 0.0 ? sum.xyz / extent : vec3(0.0);
    resolved[k] = sum.a > 0.0 ? packUnorm4x8(vec4(normal * 0.5 + 0.5, 1.0)) : 0u;
#elif FORMAT == FORMAT_SHARE8
    resolved[k] = packUnorm4x8(vec4(colour.r, 0.0, 0.0, 0.0));
#endif
}
