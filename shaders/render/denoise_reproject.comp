// SPDX-License-Identifier: MIT
// Blends the light of the pixel's own samples with that of the previous picture where it shows the same place (Schied et
// al. Spatiotemporal Variance-Guided Filtering. HPG 2017, 4.1). Both take the place of the halves, as their noise is
// independent.
//
// Places on instances that have moved since are searched where these were.
//
// Defines: HAS_NOTED_MOTION the motion of each pixel is known.
//
// The kept words of a pixel: rg; b and its worth in samples, as half floats; the guide.

#include "render/denoise.glsl"

uniform float samples;            // samples per pixel
uniform float samples_before_max; // maximum worth of the kept light for each of them; 0: none was kept
// Camera of the previous picture: rows of world_from_view, and its extent as in shared/frame.h.
uniform vec4 before_row_0;
uniform vec4 before_row_1;
uniform vec4 before_row_2;
uniform vec4 before_extent;
uniform int before_width;
uniform int before_height;

layout(binding = UNIT_DENOISE_LIGHT) uniform usamplerBuffer light;
layout(binding = UNIT_DENOISE_GUIDE) uniform usamplerBuffer guides;
layout(binding = UNIT_DENOISE_FIRST) uniform usamplerBuffer before;
#ifdef HAS_NOTED_MOTION
layout(binding = UNIT_DENOISE_MOTION) uniform usamplerBuffer motions;
#endif
layout(std430, binding = BIND_DENOISE_OUT) writeonly buffer light_block { uvec4 blended[]; };
layout(std430, binding = BIND_DENOISE_OUT_TOO) writeonly buffer kept_block { uvec4 kept[]; };

// Place in view space at that distance along the view.
vec3 view_place(vec2 place, vec2 extent, bool orthographic, float nearness)
{
    float depth = orthographic ? nearness : 1.0 / nearness;
    return vec3((2.0 * place - 1.0) * vec2(extent.x, -extent.y) * (orthographic ? 1.0 : depth), -depth);
}

vec3 world_from_before(vec3 p)
{
    return vec3(dot(before_row_0, vec4(p, 1.0)), dot(before_row_1, vec4(p, 1.0)), dot(before_row_2, vec4(p, 1.0)));
}

// rgb: the light kept for that place, w: its worth in samples.
vec4 light_before(vec3 place_world, guide own, float depth)
{
    bool orthographic = before_extent.w != 0.0;
    vec3 d = place_world - vec3(before_row_0.w, before_row_1.w, before_row_2.w);
    vec3 p = d.x * before_row_0.xyz + d.y * before_row_1.xyz + d.z * before_row_2.xyz;
    vec2 size = vec2(before_width, before_height);
    vec2 scaled = p.xy / (vec2(before_extent.x, -before_extent.y) * (orthographic ? 1.0 : max(-p.z, 1e-30)));
    vec2 at = clamp((0.5 * scaled + 0.5) * size - 0.5, vec2(-2.0), size + 1.0);
    ivec2 first = ivec2(floor(at));
    vec2 share = at - vec2(first);
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (int i = 0; i < 4; i++) {
        ivec2 off = ivec2(i & 1, i >> 1), next = first + off;
        bool inside = p.z < 0.0 && within(next, ivec2(0), ivec2(before_width, before_height));
        uvec4 words = texelFetch(before, inside ? next.y * before_width + next.x : 0);
        guide other = guide_of_words(words.zw);
        bool there = inside && other.nearness > 0.0;
        vec3 other_world = world_from_before(view_place((vec2(next) + 0.5) / size, before_extent.xy, orthographic,
                                                        there ? other.nearness : 1.0));
        bool same = there && turn_of(own, other) < DENOISE_SAME_TURN &&
                    abs(dot(own.normal, other_world - place_world)) < DENOISE_SAME_DEPTH * depth;
        vec2 each = mix(1.0 - share, share, vec2(off));
        float weight = same ? each.x * each.y : 0.0;
        vec2 last = unpackHalf2x16(words.y);
        sum += weight * vec4(unpackHalf2x16(words.x), last);
        weights += weight;
    }
    return weights > 0.01 ? sum / weights : vec4(0.0);
}

// Clamps a colour to the mean of the pixels around, within their deviation (Salvi. An Excursion in Temporal
// Supersampling. GDC 2016).
vec3 clipped(vec3 colour, ivec2 pixel, ivec2 lower, ivec2 upper, guide own)
{
    vec3 sum = vec3(0.0), squares = vec3(0.0);
    float count = 0.0;
    for (int i = 0; i < 9; i++) {
        ivec2 next = clamp(pixel + ivec2(i % 3 - 1, i / 3 - 1), lower, upper - 1);
        int place = place_of(next);
        guide other = guide_of_words(texelFetch(guides, place).xy);
        float weight = is_alike(own, other) ? 1.0 : 0.0;
        vec3 mean = mean_of(halves_of_words(texelFetch(light, place)));
        sum += weight * mean;
        squares += weight * mean * mean;
        count += weight;
    }
    vec3 mean = sum / max(count, 1.0);
    vec3 deviation = sqrt(max(squares / max(count, 1.0) - mean * mean, vec3(0.0)));
    return clamp(colour, mean - DENOISE_CLIP * deviation, mean + DENOISE_CLIP * deviation);
}

void main()
{
    ivec2 pixel, lower, upper;
    if (!pixel_of_item(pixel))
        return;
    bounds_of(pixel, lower, upper);
    int place = place_of(pixel);
    uvec2 guide_words = texelFetch(guides, place).xy;
    guide own = guide_of_words(guide_words);
    halves h = halves_of_words(texelFetch(light, place));
    vec3 mean = mean_of(h);
    float count = samples;
    vec3 motion = vec3(0.0);
    bool known = true;
#ifdef HAS_NOTED_MOTION
    known = motion_of_words(texelFetch(motions, place).xy, motion);
#endif
    if (samples_before_max > 0.0 && own.nearness > 0.0 && known) {
        bool orthographic = frame.extent_near.w != 0.0;
        vec3 p = view_place((vec2(pixel) + 0.5) / vec2(frame.view_width, frame.view_height), frame.extent_near.xy,
                            orthographic, own.nearness);
        vec3 place_world = eye_world() + world_from_view_vector(p) - motion * p.z;
        vec4 was = light_before(place_world, own, orthographic ? frame.extent_near.y : -p.z);
        float worth = min(was.w, samples_before_max * samples) * (1.0 - DENOISE_HISTORY_DOUBT * own.share);
        if (worth > 0.0) {
            was.rgb = clipped(was.rgb, pixel, lower, upper, own);
            count += worth;
            vec3 noise = (was.rgb - mean) * (sqrt(worth * samples) / count);
            mean += (was.rgb - mean) * (worth / count);
            h = halves(mean + noise, mean - noise, 0.0);
        }
    }
    blended[place] = words_of_taken(h.a, h.b, 0.0);
    mean = min(mean, vec3(HALF_FLOAT_MAX));
    kept[place] = uvec4(packHalf2x16(mean.rg), packHalf2x16(vec2(mean.b, min(count, HALF_FLOAT_MAX))), guide_words);
}
