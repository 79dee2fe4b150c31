// SPDX-License-Identifier: MIT
// Brings the difference of the halves down to the noise that neighbours show, and notes how large it is around a pixel.

#include "render/denoise.glsl"

layout(binding = UNIT_DENOISE_LIGHT) uniform usamplerBuffer light;
layout(binding = UNIT_DENOISE_GUIDE) uniform usamplerBuffer guides;
layout(binding = UNIT_DENOISE_RISK) uniform samplerBuffer risks;
layout(std430, binding = BIND_DENOISE_OUT) writeonly buffer light_block { uvec4 settled[]; };

void main()
{
    ivec2 pixel, lower, upper;
    if (!pixel_of_item(pixel))
        return;
    bounds_of(pixel, lower, upper);
    int place = place_of(pixel);
    guide own = guide_of_words(texelFetch(guides, place));
    vec2 sum = vec2(0.0);
    float weights = 0.0;
    for (int y = -2; y <= 2; y++) {
        for (int x = -2; x <= 2; x++) {
            ivec2 offset = ivec2(x, y), next = pixel + offset;
            bool inside = within(next, lower, upper);
            int next_place = place_of(inside ? next : pixel);
            guide other = guide_of_words(texelFetch(guides, next_place));
            float weight = inside && is_alike(own, other) ? 1.0 : 0.0;
            sum += weight * texelFetch(risks, next_place).xy;
            weights += weight;
        }
    }
    halves h = halves_of_words(texelFetch(light, place));
    float share = sum.x > 0.0 ? min(sqrt(DENOISE_NEIGHBOURS_TRUST * sum.y / sum.x), 1.0) : 0.0;
    vec3 mean = mean_of(h), noise = noise_of(h) * share;
    h.a = mean + noise;
    h.b = mean - noise;
    h.deviation = share * sqrt(2.0 * sum.x / max(weights, 1.0));
    settled[place] = words_of_halves(h);
}
