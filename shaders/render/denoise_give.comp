// SPDX-License-Identifier: MIT
// From the strip to the sums of a band: the picture's, moved by as much as filtering has moved the light.
//
// What the filter has left out because it was much brighter than its surroundings stays where each half of the samples has
// half of it, as the halves of few samples differ by as much, or a pixel beside it is as bright: a highlight. What one half
// has alone is a speck, which is worth next to nothing where it was found (DeCoro, Weyrich, Rusinkiewicz. Density-based
// Outlier Rejection in Monte Carlo Rendering. 2010, by neighbours and halves in place of all samples); in mirrors and glass it is
// as often a light that is smaller there than a pixel, which few samples find.
//
// Defines: HAS_REPROJECTED what pictures before have brought has moved it, too.

#include "render/denoise.glsl"
#include "render/denoise_count.glsl"
#include "render/denoise_half.glsl"

uniform uint band_row; // the first row of the band in the picture
uniform float strength;

layout(binding = UNIT_DENOISE_LIGHT) uniform usamplerBuffer light;
layout(binding = UNIT_DENOISE_FIRST) uniform usamplerBuffer first_light;
layout(binding = UNIT_DENOISE_GUIDE) uniform usamplerBuffer guides;
#ifdef HAS_REPROJECTED
layout(binding = UNIT_DENOISE_WIDER) uniform usamplerBuffer kept; // denoise_reproject.comp
#endif
layout(std430, binding = BIND_ACCUMULATION) readonly buffer accumulation_block { vec4 accumulation[]; };
layout(std430, binding = BIND_DENOISE_HALF) readonly buffer half_block { uvec4 first_half[]; };
layout(std430, binding = BIND_DENOISE_ALBEDO) readonly buffer albedo_block { vec4 albedos[]; };
layout(std430, binding = BIND_DENOISE_OUT) writeonly buffer band_block { vec4 denoised[]; };

// Of what was left out, `left`, the part that is a speck. Of one sample nothing is known.
vec3 speck_of(vec3 left, vec3 mean, vec3 albedo, uint slot, float count)
{
    float first_count = float(first_half_of(uint(count))), second_count = count - first_count;
    vec3 first = light_of_half(first_half[slot]) * albedo, second = (count * mean - first_count * first) / max(second_count, 1.0);
    vec3 lesser = luminance(first) < luminance(second) ? first : second;
    float shown = luminance(lesser) - luminance(mean - left), all = luminance(left);
    return second_count > 0.0 && all > 0.0 ? left * (1.0 - clamp(2.0 * shown / all, 0.0, 1.0)) : vec3(0.0);
}

// 1: no pixel beside it is about as bright, by both halves, as one half may have a speck there.
float is_alone(ivec2 pixel, vec3 filtered)
{
    ivec2 lower, upper;
    bounds_of(pixel, lower, upper);
    float most = 0.0;
    for (int i = 0; i < 9; i++) {
        ivec2 next = clamp(pixel + ivec2(i % 3 - 1, i / 3 - 1), lower, upper - 1);
        halves h = halves_of_words(texelFetch(first_light, place_of(next)));
        float shown = min(luminance(h.a), luminance(h.b));
        most = max(most, next == pixel ? 0.0 : shown);
    }
    float share = most / max(luminance(filtered), 1e-30);
    return 1.0 - clamp((share - DENOISE_ALONE) / DENOISE_ALONE, 0.0, 1.0);
}

void main()
{
    ivec2 pixel;
    if (!pixel_of_item(pixel))
        return;
    int place = place_of(pixel);
    guide own = guide_of_words(texelFetch(guides, place).xy);
    uint slot = slot_of_pixel(uvec2(pixel.x, uint(pixel.y) + strip_row - band_row));
    float count = samples_of_slot(slot);
    vec4 sum = accumulation[slot];
    vec3 albedo = divisor_of(albedos[slot].rgb / notes_of_slot(slot, count));
    vec3 filtered = mean_of(halves_of_words(texelFetch(first_light, place)));
    vec3 moved = mean_of(halves_of_words(texelFetch(light, place))) - filtered;
#ifdef HAS_REPROJECTED
    uvec2 words = texelFetch(kept, place).xy;
    moved += vec3(unpackHalf2x16(words.x), unpackHalf2x16(words.y).x) - sum.rgb / (count * albedo);
#else
    vec3 mean = sum.rgb / count;
    float believed = DENOISE_SPECK_DOUBT * (1.0 - DENOISE_MIRROR_DOUBT * own.share) * is_alone(pixel, filtered);
    moved -= believed * speck_of(mean - filtered * albedo, mean, albedo, slot, count) / albedo;
#endif
    denoised[slot] = vec4(own.nearness > 0.0 ? max(sum.rgb + strength * moved * albedo * count, vec3(0.0)) : sum.rgb, sum.a);
}
