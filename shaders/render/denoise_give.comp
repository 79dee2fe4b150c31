// SPDX-License-Identifier: MIT
// From the strip to the sums of a band: the picture's, moved by as much as filtering has moved the light.
// Defines: HAS_REPROJECTED what pictures before have brought has moved it, too.

#include "render/denoise.glsl"
#include "render/denoise_count.glsl"

uniform uint band_row; // the first row of the band in the picture
uniform float strength;

layout(binding = UNIT_DENOISE_LIGHT) uniform usamplerBuffer light;
layout(binding = UNIT_DENOISE_FIRST) uniform usamplerBuffer first_light;
layout(binding = UNIT_DENOISE_GUIDE) uniform usamplerBuffer guides;
#ifdef HAS_REPROJECTED
layout(binding = UNIT_DENOISE_WIDER) uniform usamplerBuffer kept; // denoise_reproject.comp
#endif
layout(std430, binding = BIND_ACCUMULATION) readonly buffer accumulation_block { vec4 accumulation[]; };
layout(std430, binding = BIND_DENOISE_ALBEDO) readonly buffer albedo_block { vec4 albedos[]; };
layout(std430, binding = BIND_DENOISE_OUT) writeonly buffer band_block { vec4 denoised[]; };

void main()
{
    ivec2 pixel;
    if (!pixel_of_item(pixel))
        return;
    int place = place_of(pixel);
    uint slot = slot_of_pixel(uvec2(pixel.x, uint(pixel.y) + strip_row - band_row));
    float count = samples_of_slot(slot);
    vec4 sum = accumulation[slot];
    vec3 albedo = max(albedos[slot].rgb / notes_of_slot(slot, count), vec3(DENOISE_ALBEDO_MIN));
    vec3 moved = mean_of(halves_of_words(texelFetch(light, place))) -
                 mean_of(halves_of_words(texelFetch(first_light, place)));
#ifdef HAS_REPROJECTED
    uvec2 words = texelFetch(kept, place).xy;
    moved += vec3(unpackHalf2x16(words.x), unpackHalf2x16(words.y).x) - sum.rgb / (count * albedo);
#endif
    bool there = uintBitsToFloat(texelFetch(guides, place).y) > 0.0;
    denoised[slot] = vec4(there ? max(sum.rgb + strength * moved * albedo * count, vec3(0.0)) : sum.rgb, sum.a);
}
