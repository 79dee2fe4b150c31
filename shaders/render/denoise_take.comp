// SPDX-License-Identifier: MIT
// Reads the sums of a band into the strip: the light that falls at each pixel, as two halves, and the guide.

#include "render/denoise.glsl"
#include "render/denoise_count.glsl"
#include "render/denoise_half.glsl"

uniform uint band_row; // first row of the band in the picture

layout(std430, binding = BIND_ACCUMULATION) readonly buffer accumulation_block { vec4 accumulation[]; };
layout(std430, binding = BIND_DENOISE_HALF) readonly buffer half_block { uvec4 first_half[]; };
layout(std430, binding = BIND_DENOISE_ALBEDO) readonly buffer albedo_block { vec4 albedos[]; };
layout(std430, binding = BIND_DENOISE_NORMAL) readonly buffer normal_block { vec4 normals[]; };
layout(std430, binding = BIND_DENOISE_GUIDE) writeonly buffer guide_block { uvec2 guides[]; };
layout(std430, binding = BIND_DENOISE_OUT) writeonly buffer light_block { uvec4 light[]; };
#ifdef HAS_NOTED_MOTION
layout(std430, binding = BIND_DENOISE_OUT_TOO) writeonly buffer strip_block { uvec2 strip_motions[]; };
#endif

void main()
{
    ivec2 pixel;
    if (!pixel_of_item(pixel))
        return;
    uint slot = slot_of_pixel(uvec2(pixel.x, uint(pixel.y) + strip_row - band_row));
    float count = samples_of_slot(slot), first_count = float(first_half_of(uint(count))), second_count = count - first_count;
    float noted = notes_of_slot(slot, count);
    vec4 albedo = albedos[slot] / noted, normal = normals[slot] / noted;
    vec3 mean = accumulation[slot].rgb / (count * divisor_of(albedo.rgb)), noise = vec3(0.0);
    if (second_count > 0.0)
        noise = (light_of_half(first_half[slot]) - mean) * sqrt(first_count / second_count);
    float depth = normal.w;
    // Fully covered: otherwise the background would be spread over the edge, too.
    bool there = depth > 0.0 && albedo.a <= 1.0;
    guide g = guide(there ? normal.xyz : vec3(0.0), min(albedo.a + (count - noted) / count, 1.0), 0.0,
                    sqrt(luminance(albedo.rgb)));
    if (there)
        g.nearness = frame.extent_near.w != 0.0 ? depth : 1.0 / depth;
    int place = place_of(pixel);
    guides[place] = words_of_guide(g);
    float half_noise = count == 2.0 * first_count && count > 4.0 ? luminance(difference_of_half(first_half[slot])) : 0.0;
    light[place] = words_of_taken(mean + noise, mean - noise, half_noise);
#ifdef HAS_NOTED_MOTION
    vec3 motion = motions[slot].xyz / (noted * max(depth, 1e-30));
    strip_motions[place] = words_of_motion(motion);
#endif
}
