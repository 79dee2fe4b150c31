// SPDX-License-Identifier: MIT
// Filters a level of an edge-avoiding a-trous wavelet (Dammertz et al. Edge-Avoiding A-Trous Wavelet Transform for fast
// Global Illumination Filtering. HPG 2010), whose weights compare differences of light with the variance (Schied et al.
// Spatiotemporal Variance-Guided Filtering. HPG 2017, 4.4). Each half is weighed by the light of the other, so that noise
// does not select itself (Rousselle et al. Adaptive Rendering with Non-Local Means Filtering. 2012). Albedo weighs too,
// though light is divided by it: scattered and mirrored light differ, and the albedo says how much of each there is.
//
// Also computes the parts of each pixel's risk for denoise_choose.comp. Where a surface turns within few pixels, the
// light turns with it, also within pixels, where halves of the samples differ by detail: the difference that the cosine
// explains is no noise.

#include "render/denoise.glsl"

uniform int spacing;

layout(binding = UNIT_DENOISE_LIGHT) uniform usamplerBuffer light;
layout(binding = UNIT_DENOISE_GUIDE) uniform usamplerBuffer guides;
layout(binding = UNIT_DENOISE_SLOPE) uniform usamplerBuffer slopes;
layout(binding = UNIT_DENOISE_FIRST) uniform usamplerBuffer first_light;
layout(std430, binding = BIND_DENOISE_OUT) writeonly buffer light_block { uvec4 wider[]; };
layout(std430, binding = BIND_DENOISE_OUT_TOO) writeonly buffer risk_block { vec2 risks[]; };

// Numerator and denominator of a pixel's choice, as shares of its light: from the light at this level, filtered, and
// before any level.
vec2 risk_of(halves as_is, halves filtered, halves own)
{
    vec3 step_ = mean_of(as_is) - mean_of(filtered), noise_step = noise_of(as_is) - noise_of(filtered);
    float gain = dot(mean_of(as_is) - mean_of(own), step_) + dot(noise_of(own), noise_step);
    return vec2(gain, dot(step_, step_)) / square(luminance(abs(mean_of(filtered))) + DENOISE_DARK);
}

const ivec2 NEIGHBOURS[8] = ivec2[8](ivec2(-1, -1), ivec2(0, -1), ivec2(1, -1), ivec2(-1, 0), ivec2(1, 0), ivec2(-1, 1),
                                     ivec2(0, 1), ivec2(1, 1));

void main()
{
    ivec2 pixel, lower, upper;
    if (!pixel_of_item(pixel))
        return;
    bounds_of(pixel, lower, upper);
    int place = place_of(pixel);
    guide own = guide_of_words(texelFetch(guides, place).xy);
    vec2 slope = unpackHalf2x16(texelFetch(slopes, place).x);
    halves h = halves_of_words(texelFetch(light, place));
    vec2 own_luminance = vec2(luminance(h.a), luminance(h.b)), weights = vec2(0.25);
    float scale = DENOISE_LIGHT_SCALE * (1.0 - DENOISE_MIRROR_EDGES * own.share), variance = square(0.25 * h.deviation);
    float sharpness = 1.0 / (scale * h.deviation + 1e-6);
    vec3 sum_a = 0.25 * h.a, sum_b = 0.25 * h.b;
    float turns = 0.0;
    for (int i = 0; i < 8; i++) {
        ivec2 step_ = NEIGHBOURS[i], offset = step_ * spacing;
        ivec2 next = pixel + offset;
        bool counts = within(next, lower, upper);
        int next_place = place_of(counts ? next : pixel);
        guide other = guide_of_words(texelFetch(guides, next_place).xy);
        halves e = halves_of_words(texelFetch(light, next_place));
        float off = off_surface(own, slope, other, vec2(offset)) + DENOISE_TONE_SCALE * abs(own.tone - other.tone);
        vec2 apart = abs(vec2(luminance(e.b), luminance(e.a)) - own_luminance.yx) * sharpness;
        float kernel = counts ? (step_.x == 0 || step_.y == 0 ? 0.125 : 0.0625) : 0.0;
        vec2 weight = kernel * exp2(-(off + apart));
        sum_a += weight.x * e.a;
        sum_b += weight.y * e.b;
        weights += weight;
        turns += weight.x * turn_of(own, other);
        variance += square(0.5 * (weight.x + weight.y) * e.deviation);
    }
    halves filtered = halves(sum_a / weights.x, sum_b / weights.y, sqrt(variance) / (0.5 * (weights.x + weights.y)));
    wider[place] = words_of_halves(filtered);
    bool there = own.nearness > 0.0; // an empty pixel stays as it is, and does not affect its neighbours
    float detail = DENOISE_TURNED_LIGHT * turns / weights.x;
    risks[place] = there ? risk_of(h, filtered, halves_of_words(texelFetch(first_light, place))) + vec2(0.0, detail) : vec2(0.0);
}
