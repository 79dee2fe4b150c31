// SPDX-License-Identifier: MIT
// Estimates the mean error of the pixels of each tile: server/render/picture/noise.h.

#include "shared/path.h"
#include "common/slots.glsl"
#include "common/dispatch.glsl"

layout(local_size_x = 64) in;

uniform uint first_tile, tile_count;  // tiles of the band
uniform uint samples, half_samples;   // per pixel; half_samples 0: nothing is measured
uniform uint keep;                    // 1: the sums become those of the first half
uniform float exposure;

layout(binding = UNIT_TILE_SAMPLES) uniform usamplerBuffer tile_samples;
layout(std430, binding = BIND_ACCUMULATION) readonly buffer accumulation_block { vec4 accumulation[]; };
layout(std430, binding = BIND_HALVES) buffer half_block { vec4 halves[]; };
layout(std430, binding = BIND_TILE_ERRORS) writeonly buffer error_block { float tile_errors[]; };

const float DARK = 0.03; // share of white: errors below it count absolutely, not relative to the light

void main()
{
    uint tile = item_index();
    if (tile >= tile_count || texelFetch(tile_samples, int(first_tile + tile)).x != 0u)
        return;
    float light = 0.0, squares = 0.0, alpha_squares = 0.0, pixels = 0.0;
    for (uint slot = tile * TILE_SLOTS; slot < (tile + 1u) * TILE_SLOTS; slot++) {
        uvec2 pixel = pixel_of_slot(first_tile * TILE_SLOTS + slot);
        vec4 sum = accumulation[slot], first = halves[slot];
        if (pixel.x < frame.width && pixel.y < frame.height) {
            vec4 mean = sum / float(samples), off = mean - first / float(max(half_samples, 1u));
            light += dot(mean.rgb, vec3(1.0 / 3.0));
            squares += dot(off.rgb, off.rgb) * (1.0 / 3.0);
            alpha_squares += off.a * off.a;
            pixels += 1.0;
        }
        if (keep != 0u)
            halves[slot] = sum;
    }
    if (half_samples == 0u)
        return;
    float ratio = float(half_samples) / float(samples - half_samples);
    float error = exposure * sqrt(squares / pixels * ratio) / (exposure * light / pixels + DARK);
    tile_errors[first_tile + tile] = min(max(error, sqrt(alpha_squares / pixels * ratio)), 1e6);
}
