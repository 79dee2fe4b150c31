// SPDX-License-Identifier: MIT
// Writes the strip back to the sums of a band, moved by as much as filtering has moved the light.
//
// A pixel stays as bright as it is where a pixel beside it is as bright by both halves of its samples: a highlight. Any
// other pixel is brighter or darker than its neighbours only as far as each part of its samples agrees. The rest is a
// speck, which is hardly ever right at its place (DeCoro, Weyrich, Rusinkiewicz. Density-based Outlier Rejection in Monte
// Carlo Rendering. 2010, by neighbours and parts in place of all samples), and goes to their mean.
//
// Defines: HAS_REPROJECTED earlier pictures have moved the light, too.

#include "render/denoise.glsl"
#include "render/denoise_count.glsl"
#include "render/denoise_half.glsl"

uniform uint band_row; // first row of the band in the picture
uniform float strength;

layout(binding = UNIT_DENOISE_LIGHT) uniform usamplerBuffer light;
layout(binding = UNIT_DENOISE_FIRST) uniform usamplerBuffer first_light;
layout(binding = UNIT_DENOISE_GUIDE) uniform usamplerBuffer guides;
#ifdef HAS_REPROJECTED
layout(binding = UNIT_DENOISE_WIDER) uniform usamplerBuffer kept; // output of denoise_reproject.comp
#endif
layout(std430, binding = BIND_ACCUMULATION) readonly buffer accumulation_block { vec4 accumulation[]; };
layout(std430, binding = BIND_DENOISE_HALF) readonly buffer half_block { uvec4 first_half[]; };
layout(std430, binding = BIND_DENOISE_ALBEDO) readonly buffer albedo_block { vec4 albedos[]; };
layout(std430, binding = BIND_DENOISE_OUT) writeonly buffer band_block { vec4 denoised[]; };

struct surroundings {
    vec3 mean;
    float least, most; // luminance without the outermost, as two specks may lie side by side
    float shown;       // maximum luminance that both halves of a pixel have
};

surroundings surroundings_of(ivec2 pixel)
{
    ivec2 lower, upper;
    bounds_of(pixel, lower, upper);
    surroundings around = surroundings(vec3(0.0), 1e30, 0.0, 0.0);
    vec2 outermost = vec2(1e30, 0.0);
    float count = 0.0;
    for (int i = 0; i < 9; i++) {
        ivec2 next = pixel + ivec2(i % 3 - 1, i / 3 - 1);
        if (next == pixel || !within(next, lower, upper))
            continue;
        vec3 colour = mean_of(halves_of_words(texelFetch(light, place_of(next))));
        halves first = halves_of_words(texelFetch(first_light, place_of(next)));
        float beside = luminance(colour);
        around.mean += colour;
        around.least = min(around.least, max(outermost.x, beside));
        around.most = max(around.most, min(outermost.y, beside));
        around.shown = max(around.shown, min(luminance(first.a), luminance(first.b)));
        outermost = vec2(min(outermost.x, beside), max(outermost.y, beside));
        count += 1.0;
    }
    around.mean /= max(count, 1.0);
    return around;
}

// Minimum and maximum luminance over the parts of the samples: halves, or quarters if there are many.
vec2 range_of_parts(vec3 mean, uint slot, float count)
{
    float first_count = float(first_half_of(uint(count)));
    vec3 first = light_of_half(first_half[slot]), second = (count * mean - first_count * first) / (count - first_count);
    vec3 apart = first_count > 2.0 ? difference_of_half(first_half[slot]) : vec3(0.0);
    vec3 parts = vec3(luminance(first - apart), luminance(first + apart), luminance(second));
    return vec2(min_component(parts), max_component(parts));
}

// Light of a pixel without specks, which are replaced by the mean around it. `filtered`: the part that the filter has
// kept. A part that is half as far off as the whole confirms it, as parts differ by that much anyway.
vec3 without_specks(vec3 own, vec3 filtered, vec2 parts, surroundings around)
{
    float own_luminance = luminance(own);
    float alone = 1.0 - clamp((around.shown / max(luminance(filtered), 1e-30) - DENOISE_ALONE) / DENOISE_ALONE, 0.0, 1.0);
    float over = own_luminance - max(around.most, 2.0 * parts.x - around.most);
    float under = min(around.least, 2.0 * parts.y - around.least) - own_luminance;
    float off = max(max(alone * over, under), 0.0);
    return mix(own, around.mean, clamp(off / max(abs(own_luminance - luminance(around.mean)), 1e-30), 0.0, 1.0));
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
    if (count > 1.0) { // a single sample proves nothing
        vec3 mean = sum.rgb / (count * albedo);
        moved = without_specks(mean + moved, filtered, range_of_parts(mean, slot, count), surroundings_of(pixel)) - mean;
    }
#endif
    denoised[slot] = vec4(own.nearness > 0.0 ? max(sum.rgb + strength * moved * albedo * count, vec3(0.0)) : sum.rgb, sum.a);
}
