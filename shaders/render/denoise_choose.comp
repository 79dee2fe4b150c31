// SPDX-License-Identifier: MIT
// Chooses how far each pixel moves towards the wider filter: to the minimum of its mean square error, by Stein's unbiased
// estimate of that around the pixel (Li et al. SURE-based Optimization for Adaptive Sampling and Reconstruction. 2012),
// where half the difference of the halves, filtered alike, represents the noise.
//
// With c the light, F its filtered light, y the picture's and t the true one, |(1 - s) c + s F - t|^2 is smallest at
//
//   s = (c - t)(c - F) / (c - F)^2,  where  E (c - t)(c - F) = E (c - y)(c - F) + E n (n_c - n_F)
//
// with n the noise of y and n_c, n_F its rest after the filters. Without noise s is 0.
//
// Both are means of few pixels, and where the gain is tiny chance decides. So DENOISE_MARGIN standard errors are
// subtracted from the gain, and a move by less than DENOISE_UNSEEN of the light counts as none, as it would not be
// visible.

#include "render/denoise.glsl"

uniform int spacing; // distance of the pixels around

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
    float squares = 0.0, gains = 0.0;
    for (int y = -DENOISE_CHOICE_RADIUS; y <= DENOISE_CHOICE_RADIUS; y++) {
        for (int x = -DENOISE_CHOICE_RADIUS; x <= DENOISE_CHOICE_RADIUS; x++) {
            ivec2 next = clamp(pixel + ivec2(x, y) * spacing, lower, upper - 1);
            vec2 risk = texelFetch(risks, place_of(next)).xy;
            sum += risk;
            squares += square(risk.y);
            gains += square(risk.x);
        }
    }
    const float count = square(2.0 * float(DENOISE_CHOICE_RADIUS) + 1.0);
    float gain = sum.x - DENOISE_MARGIN * sqrt(max(gains - sum.x * sum.x / count, 0.0));
    float share = clamp(gain / (sum.y + count * square(DENOISE_UNSEEN)), 0.0, 1.0);
    float witnesses = squares > 0.0 ? square(sum.y) / squares : 0.0;
    share *= clamp((witnesses - 1.0) / DENOISE_WITNESSES, 0.0, 1.0);
    int place = place_of(pixel);
    halves as_is = halves_of_words(texelFetch(light, place)), filtered = halves_of_words(texelFetch(wider, place));
    halves result = halves(mix(as_is.a, filtered.a, share), mix(as_is.b, filtered.b, share),
                           mix(as_is.deviation, filtered.deviation, share));
    chosen[place] = words_of_halves(result);
}
