// SPDX-License-Identifier: MIT
// How far each pixel goes on to the wider filter: as far as its mean square error is smallest, by Stein's unbiased estimate
// of that around the pixel (Li et al. SURE-based Optimization for Adaptive Sampling and Reconstruction. 2012), in which half
// the difference of the halves, filtered alike, stands for the noise.
//
// With c the light, F its filtered light, y the picture's and t the true one, |(1 - s) c + s F - t|^2 is smallest at
//
//   s = (c - t)(c - F) / (c - F)^2,  where  E (c - t)(c - F) = E (c - y)(c - F) + E n (n_c - n_F)
//
// with n the noise of y and n_c, n_F what the filters leave of it. Without noise s is 0.

#include "render/denoise.glsl"

uniform int spacing; // of the pixels around

layout(binding = UNIT_DENOISE_LIGHT) uniform usamplerBuffer light;
layout(binding = UNIT_DENOISE_WIDER) uniform usamplerBuffer wider;
layout(binding = UNIT_DENOISE_RISK) uniform samplerBuffer risks;
layout(std430, binding = BIND_DENOISE_OUT) writeonly buffer light_block { uvec4 chosen[]; };

void main()
{
    ivec2 pixel, lower, upper;
    if (!pixel_of_item(pixel))
        return;
    bounds_of(pixel, lower, upper);
    vec2 sum = vec2(0.0);
    float squares = 0.0;
    for (int y = -2; y <= 2; y++) {
        for (int x = -2; x <= 2; x++) {
            ivec2 next = clamp(pixel + ivec2(x, y) * spacing, lower, upper - 1);
            vec2 risk = texelFetch(risks, place_of(next)).xy;
            sum += risk;
            squares += square(risk.y);
        }
    }
    float share = sum.y > 0.0 ? clamp(sum.x / sum.y, 0.0, 1.0) : 0.0;
    float witnesses = squares > 0.0 ? square(sum.y) / squares : 0.0;
    share *= clamp((witnesses - 1.0) / DENOISE_WITNESSES, 0.0, 1.0);
    int place = place_of(pixel);
    halves as_is = halves_of_words(texelFetch(light, place)), filtered = halves_of_words(texelFetch(wider, place));
    halves result = halves(mix(as_is.a, filtered.a, share), mix(as_is.b, filtered.b, share),
                           mix(as_is.deviation, filtered.deviation, share));
    chosen[place] = words_of_halves(result);
}
