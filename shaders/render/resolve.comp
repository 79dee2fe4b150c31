// SPDX-License-Identifier: MIT
// From sums of samples to pixels of the output's format, rows from the top. Linear formats are premultiplied by
// alpha, RGBA8 is straight, tone-mapped and sRGB. Attachments: depth as it is, normals as unit vectors in 8 bits.

#include "shared/path.h"
#include "common/camera.glsl"
#include "common/dispatch.glsl"
#include "common/tonemap.glsl"

layout(local_size_x = 64) in;

#define FORMAT_RGBA8 0u
#define FORMAT_RGBA16F 1u
#define FORMAT_RGBA32F 2u
#define FORMAT_DEPTH32F 3u
#define FORMAT_NORMAL8 4u

uniform uint pixel_count; // of the band
uniform uint format_number;
uniform uint tone_map_kind;
uniform float scale;      // exposure / samples
uniform float coverage_scale; // 1 / samples

layout(std430, binding = BIND_ACCUMULATION) readonly buffer accumulation_block { vec4 accumulation[]; };
layout(std430, binding = BIND_RESOLVED) writeonly buffer resolved_block { uint resolved[]; };

const float HALF_MAX = 65504.0;

void main()
{
    uint k = item_index();
    if (k >= pixel_count)
        return;
    vec4 sum = accumulation[slot_of_pixel(uvec2(k % frame.width, k / frame.width))];
    vec4 colour = vec4(sum.rgb * scale, clamp(sum.a * coverage_scale, 0.0, 1.0));
    if (format_number == FORMAT_RGBA8) {
        vec3 straight = colour.a > 0.0 ? colour.rgb / colour.a : colour.rgb;
        resolved[k] = packUnorm4x8(vec4(srgb_from_linear(tone_map(straight, tone_map_kind)), colour.a));
    } else if (format_number == FORMAT_RGBA16F) {
        colour = min(colour, vec4(HALF_MAX));
        resolved[2u * k] = packHalf2x16(colour.rg);
        resolved[2u * k + 1u] = packHalf2x16(colour.ba);
    } else if (format_number == FORMAT_DEPTH32F) {
        resolved[k] = floatBitsToUint(sum.r);
    } else if (format_number == FORMAT_NORMAL8) {
        float extent = length(sum.xyz); // 0 also where normals cancel each other out
        vec3 normal = extent > 0.0 ? sum.xyz / extent : vec3(0.0);
        resolved[k] = sum.a > 0.0 ? packUnorm4x8(vec4(normal * 0.5 + 0.5, 1.0)) : 0u;
    } else {
        for (int i = 0; i < 4; i++)
            resolved[4u * k + uint(i)] = floatBitsToUint(colour[i]);
    }
}
