// SPDX-License-Identifier: MIT
// The mean of a pixel's samples, and its display value.
#include "common/camera.glsl"
#include "common/tonemap.glsl"

uniform uint tone_map_kind;
uniform float scale;          // exposure / samples
uniform float coverage_scale; // 1 / samples

layout(std430, binding = BIND_ACCUMULATION) readonly buffer accumulation_block { vec4 accumulation[]; };

// `pixel` is one of the band.
vec4 sum_of_pixel(uvec2 pixel)
{
    return accumulation[slot_of_pixel(pixel)];
}

// Premultiplied by alpha.
vec4 linear_of_sum(vec4 sum)
{
    return vec4(sum.rgb * scale, clamp(sum.a * coverage_scale, 0.0, 1.0));
}

// Straight, tone-mapped and sRGB.
vec4 display_of_linear(vec4 colour)
{
    vec3 straight = colour.a > 0.0 ? colour.rgb / colour.a : colour.rgb;
    return vec4(srgb_from_linear(tone_map(straight, tone_map_kind)), colour.a);
}
