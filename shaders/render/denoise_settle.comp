// SPDX-License-Identifier: MIT
// Brings the difference of the halves down to the noise that neighbours show, and notes how large it is around a pixel, on
// whatever surface: how noisy light is differs little from one to the next, and more witnesses say more.

#include "render/denoise.glsl"

layout(binding = UNIT_DENOISE_LIGHT) uniform usamplerBuffer light;
layout(binding = UNIT_DENOISE_RISK) uniform samplerBuffer risks;
layout(std430, binding = BIND_DENOISE_OUT) writeonly buffer light_block { uvec4 settled[]; };

void main()
{
    ivec2 pixel, lower, upper;
    if (!pixel_of_item(pixel))
        return;
    bounds_of(pixel, lower, upper);
    int place = place_of(pixel);
    vec2 sum = vec2(0.0);
    float weights = 0.0;
    for (int y = -2; y <= 2; y++) {
        for (int x = -2; x <= 2; x++) {
            ivec2 next = clamp(pixel + ivec2(x, y), lower, upper - 1);
            vec2 risk = texelFetch(risks, place_of(next)).xy;
            sum += max(risk, vec2(0.0));
            weights += risk.x < 0.0 ? 0.0 : 1.0;
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
