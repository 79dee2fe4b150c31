// SPDX-License-Identifier: MIT
// The mean of a pixel's samples, and its display value.
#include "common/camera.glsl"
#include "common/tonemap.glsl"

uniform uint tone_map_kind;
uniform float scale;          // exposure / samples
uniform float coverage_scale; // 1 / samples
uniform vec4 background;      // what lies behind the surfaces: linear; a: 1: a colour, 0: nothing

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

// Before the background. Premultiplied by alpha.
vec4 over_background(vec4 colour)
{
    return colour + background * (1.0 - colour.a);
}

// Straight, tone-mapped and sRGB.
vec4 display_of_linear(vec4 colour)
{
    vec3 straight = tone_map(colour.a > 0.0 ? colour.rgb / colour.a : colour.rgb, tone_map_kind);
    if (background.a > 0.0)
        return vec4(srgb_from_linear(mix(background.rgb, straight, colour.a)), 1.0);
    return vec4(srgb_from_linear(straight), colour.a);
}
