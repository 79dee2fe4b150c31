// SPDX-License-Identifier: MIT
// Mean of a pixel's samples, and its display value.
// Defines:
//   HAS_TILE_SAMPLES tiles may have stopped, and have fewer samples (server/render/picture/noise.h)
//   PAIRS            sums are an identifier and a share, twice (shared/layers.h)
//   PLAIN            sums are four numbers of the first sample, shown as they are
//   DISPLAY_VALUES   sums are display values without a curve
//   TONE_MAP         the curve, a number of common/tonemap.glsl; otherwise there is none
#include "shared/path.h"
#include "common/slots.glsl"
#include "common/tonemap.glsl"

uniform float scale;          // exposure / samples
uniform float coverage_scale; // 1 / samples
uniform vec4 background;      // background behind the surfaces: linear; a: 1: a colour, 0: nothing

#ifndef TONE_MAP
#define TONE_MAP TONE_MAP_NONE
#endif
#ifdef DISPLAY_VALUES
const bool display_values = true;
#else
const bool display_values = false;
#endif
#ifdef HAS_TILE_SAMPLES
layout(binding = UNIT_TILE_SAMPLES) uniform usamplerBuffer tile_samples;
uniform uint first_tile; // first tile of the band
uniform float exposure;  // scale is this times coverage_scale
#endif

layout(std430, binding = BIND_ACCUMULATION) readonly buffer accumulation_block { vec4 accumulation[]; };

// Sum of a pixel of the band.
vec4 sum_of_pixel(uvec2 pixel)
{
    return accumulation[slot_of_pixel(pixel)];
}

// Mean of a pixel of the band, premultiplied by alpha.
vec4 mean_of_sum(vec4 sum, uvec2 pixel)
{
    vec2 by = vec2(scale, coverage_scale);
#ifdef HAS_TILE_SAMPLES
    uint stopped_at = texelFetch(tile_samples, int(first_tile + slot_of_pixel(pixel) / TILE_SLOTS)).x;
    if (stopped_at != 0u)
        by = vec2(exposure, 1.0) * (1.0 / float(stopped_at));
#endif
#ifdef PLAIN
    return sum;
#endif
#ifdef PAIRS
    return vec4(sum.r, min(sum.g * by.y, 1.0), sum.b, min(sum.a * by.y, 1.0));
#endif
    return vec4(sum.rgb * by.x, clamp(sum.a * by.y, 0.0, 1.0));
}

vec3 straight_of(vec4 colour)
{
    return colour.a > 0.0 ? colour.rgb / colour.a : colour.rgb;
}

// Colour over the background, linear and premultiplied by alpha.
vec4 over_background(vec4 colour)
{
    if (display_values)
        colour.rgb = linear_from_srgb(clamp(straight_of(colour), 0.0, 1.0)) * (colour.a > 0.0 ? colour.a : 1.0);
    return colour + background * (1.0 - colour.a);
}

// Display value: straight alpha, tone-mapped and sRGB.
vec4 display_of_sum(vec4 colour)
{
    vec3 straight = straight_of(colour), behind = background.rgb;
    if (display_values) {
        straight = clamp(straight, 0.0, 1.0);
        behind = srgb_from_linear(behind);
    } else {
        straight = tone_map(straight, TONE_MAP);
    }
    vec4 shown = background.a > 0.0 ? vec4(mix(behind, straight, colour.a), 1.0) : vec4(straight, colour.a);
    return display_values ? shown : vec4(srgb_from_linear(shown.rgb), shown.a);
}
