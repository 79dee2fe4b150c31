// SPDX-License-Identifier: MIT
// Lowers the difference of the halves to the noise that neighbours show, and writes its size around a pixel, over all
// surfaces: noise differs little from one to the next, and more pixels make a better estimate.
//
// The difference is also limited by the halves of the halves: where the square of the error of n samples is n^-p, the
// mean square of half the difference is D(n) = E(n) (2^p - 1), and D(n / 2) is 2^p D(n). So E(n) = D(n) / (2^p - 1);
// without stratification D(n).
//
// Both are squares of a single number in each pixel, and where light has detail few pixels make up most of either sum:
// often these happen to differ little in D(n / 2), and the noise would be believed. So pixels count by the square root,
// and 2^p follows from the part m of D(n): for Gaussian noise m is 1 / (1 + 2^(3/4 p)), within 2 % for p up to 3.

#include "render/denoise.glsl"

uniform float believed; // share of the halves' noise that is believed; above 1: the error may fall that much faster

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
    float weights = 0.0, roots = 0.0, part = 0.0;
    for (int y = -2; y <= 2; y++) {
        for (int x = -2; x <= 2; x++) {
            ivec2 next = clamp(pixel + ivec2(x, y), lower, upper - 1);
            vec2 risk = texelFetch(risks, place_of(next)).xy;
            sum += max(risk, vec2(0.0));
            float there = risk.x < 0.0 ? 0.0 : 1.0;
            float both = max(risk.x, 0.0) + there * square(uintBitsToFloat(texelFetch(light, place_of(next)).w));
            float root = sqrt(both);
            roots += root;
            part += root > 0.0 ? max(risk.x, 0.0) / root : 0.0;
            weights += there;
        }
    }
    halves h = halves_of_words(texelFetch(light, place));
    float share = sum.x > 0.0 ? min(DENOISE_NEIGHBOURS_TRUST * sum.y / sum.x, 1.0) : 0.0;
    float falls = pow(max(roots - part, 0.0) / max(part, 1e-30), 4.0 / 3.0); // 2^p
    share = sqrt(min(share, believed / max(falls - 1.0, 1.0)));
    vec3 mean = mean_of(h), noise = noise_of(h) * share;
    h.a = mean + noise;
    h.b = mean - noise;
    h.deviation = share * sqrt(2.0 * sum.x / max(weights, 1.0));
    settled[place] = words_of_halves(h);
}
