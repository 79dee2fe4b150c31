// SPDX-License-Identifier: MIT
// Estimates the noise in two ways: by the difference of the halves, and by how pixels differ from their neighbours. The
// halves of stratified samples differ more than their mean is wrong (with two lights each half may have one), and edges
// of shadows and textures seen in mirrors look like noise to a difference of neighbours. So both must find noise.
//
// The second smallest difference of neighbours counts: beside an edge it is that of pixels on one side. Its mean square
// is that of the noise within a tenth where that is Gaussian. Also notes the slope of the surface.

#include "render/denoise.glsl"

uniform float white;     // 2^-exposure
uniform uint one_sample; // there are no halves: the difference of neighbours takes their place
uniform float doubt;     // share of the noise of mirrors and glass that is not believed

layout(binding = UNIT_DENOISE_LIGHT) uniform usamplerBuffer light;
layout(binding = UNIT_DENOISE_GUIDE) uniform usamplerBuffer guides;
layout(std430, binding = BIND_DENOISE_OUT) writeonly buffer risk_block { vec2 risks[]; };
layout(std430, binding = BIND_DENOISE_SLOPE) writeonly buffer slope_block { uint slopes[]; };
layout(std430, binding = BIND_DENOISE_OUT_TOO) writeonly buffer light_block { uvec4 noisy_light[]; };

const ivec2 NEIGHBOURS[4] = ivec2[4](ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));

vec3 capped(vec3 colour, float cap)
{
    return colour * min(1.0, cap / max(luminance(colour), 1e-30));
}

// Maximum brightness of a pixel for the filter, from the pixels two away. A brighter one is a highlight, or a sample that
// hit a light by chance: spread over its neighbours it would be more visible. The excess stays in its pixel.
float cap_around(ivec2 pixel, ivec2 lower, ivec2 upper, guide own)
{
    float highest = DENOISE_CAP * white / max(square(own.tone), DENOISE_ALBEDO_MIN), sum = 0.0, count = 0.0;
    for (int i = 0; i < 16; i++) {
        ivec2 side = ivec2((i & 3) - 2, -2), offset = i < 4 ? side : i < 8 ? -side : i < 12 ? ivec2(2, side.x) : ivec2(-2, -side.x);
        ivec2 next = pixel + offset;
        bool counts = within(next, lower, upper);
        int place = place_of(counts ? next : pixel);
        guide other = guide_of_words(texelFetch(guides, place).xy);
        float weight = !counts || other.nearness <= 0.0 ? 0.0 : is_alike(own, other) ? 1.0 : DENOISE_UNLIKE;
        sum += weight * min(taken_of_words(texelFetch(light, place)).x, highest);
        count += weight;
    }
    return count > 0.0 ? min(DENOISE_CAP * sum / count, highest) : highest;
}

float smaller(float a, float b)
{
    return abs(a) < abs(b) ? a : b;
}

void main()
{
    ivec2 pixel, lower, upper;
    if (!pixel_of_item(pixel))
        return;
    bounds_of(pixel, lower, upper);
    int place = place_of(pixel);
    guide own = guide_of_words(texelFetch(guides, place).xy);
    uvec4 words = texelFetch(light, place);
    halves h = halves_of_words(words);
    float cap = cap_around(pixel, lower, upper, own);
    h.a = capped(h.a, cap);
    h.b = capped(h.b, cap);
    vec3 mean = mean_of(h), least = vec3(0.0), second = vec3(0.0);
    float least_size = 1e30, second_size = 1e30, count = 0.0;
    vec4 rises = vec4(1e30); // growth of the nearness towards each neighbour
    for (int i = 0; i < 4; i++) {
        ivec2 next = pixel + NEIGHBOURS[i];
        bool inside = within(next, lower, upper);
        int next_place = place_of(inside ? next : pixel);
        guide other = guide_of_words(texelFetch(guides, next_place).xy);
        rises[i] = inside ? (other.nearness - own.nearness) * ((i & 1) == 0 ? -1.0 : 1.0) : 1e30;
        vec3 difference = mean - capped(mean_of(halves_of_words(texelFetch(light, next_place))), cap);
        float size = inside && is_alike(own, other) ? abs(luminance(difference)) : 1e30;
        count += size < 1e30 ? 1.0 : 0.0;
        if (size < least_size) {
            second = least;
            second_size = least_size;
            least = difference;
            least_size = size;
        } else if (size < second_size) {
            second = difference;
            second_size = size;
        }
    }
    vec3 apart = count < 1.0 ? vec3(0.0) : count < 3.0 ? least : second;
    vec3 noise = noise_of(h);
    if (one_sample != 0u && h.a == h.b)
        noise = apart;
    float believed = 1.0 - (one_sample != 0u && h.a == h.b ? 1.0 : doubt) * own.share;
    noise *= believed;
    h = halves(mean + noise, mean - noise, min(abs(taken_of_words(words).y), cap) * believed);
    vec2 slope = vec2(smaller(rises.x, rises.y), smaller(rises.z, rises.w));
    slope = mix(slope, vec2(0.0), greaterThan(abs(slope), vec2(1e29))); // a view one pixel wide
    slope = own.nearness > 0.0 ? clamp(slope / own.nearness, vec2(-1.0), vec2(1.0)) : vec2(0.0);
    slopes[place] = packHalf2x16(slope);
    noisy_light[place] = words_of_halves(h);
    // Pixels without a surface have no known noise.
    risks[place] = own.nearness > 0.0 ? vec2(square(luminance(noise)), square(luminance(apart))) : vec2(-1.0);
}
