// SPDX-License-Identifier: MIT
// Data that the passes of the denoiser share; server/render/passes/denoise/README.md describes the passes.
//
// A strip of the picture lies row by row. Each pixel has the mean guide of its samples, and two estimates of the light
// that falls there: the means of two halves of its samples, moved so that their mean is that of all samples and half
// their difference has the noise of that mean.

#include "shared/denoise.h"
#include "common/camera.glsl"
#include "common/colour.glsl"
#include "common/dispatch.glsl"

uniform uint first_row, item_count; // first row of the strip; items of this dispatch
uniform uint strip_row, strip_rows; // the strip's first row in the picture, and its number of rows

struct halves {
    vec3 a, b;
    float deviation; // deviation of each half, by luminance
};

struct guide {
    vec3 normal;    // mean of the samples' unit normals: shorter where they see several surfaces
    float share;    // share of mirrors and glass in the colour
    float nearness; // 1 / depth, which is linear in the picture where the surface is flat; orthographic: depth; 0: nothing
    float tone;     // square root of the albedo's luminance, up to 1
};

const float HALF_FLOAT_MAX = 6e4;

uvec4 words_of_halves(halves h)
{
    h.a = clamp(h.a, -HALF_FLOAT_MAX, HALF_FLOAT_MAX);
    h.b = clamp(h.b, -HALF_FLOAT_MAX, HALF_FLOAT_MAX);
    return uvec4(packHalf2x16(h.a.rg), packHalf2x16(vec2(h.a.b, h.b.r)), packHalf2x16(h.b.gb),
                 floatBitsToUint(h.deviation));
}

halves halves_of_words(uvec4 words)
{
    vec2 middle = unpackHalf2x16(words.y);
    return halves(vec3(unpackHalf2x16(words.x), middle.x), vec3(middle.y, unpackHalf2x16(words.z)),
                  uintBitsToFloat(words.w));
}

// Words of a pixel before the deviation is known: the luminance of the mean, and the noise of the first half by the
// difference of its own halves (0: unknown).
uvec4 words_of_taken(vec3 a, vec3 b, float half_noise)
{
    uvec4 words = words_of_halves(halves(a, b, 0.0));
    words.w = packHalf2x16(clamp(vec2(luminance(0.5 * (a + b)), half_noise), -HALF_FLOAT_MAX, HALF_FLOAT_MAX));
    return words;
}

vec2 taken_of_words(uvec4 words)
{
    return unpackHalf2x16(words.w);
}

vec3 mean_of(halves h)
{
    return 0.5 * (h.a + h.b);
}

vec3 noise_of(halves h)
{
    return 0.5 * (h.a - h.b);
}

uvec2 words_of_guide(guide g)
{
    ivec4 bytes = ivec4(round(vec4(g.normal * 127.0, g.share * 127.0))) & 0xff;
    uint tone = uint(round(clamp(g.tone, 0.0, 1.0) * 255.0));
    return uvec2(bytes.x | bytes.y << 8 | bytes.z << 16 | bytes.w << 24, floatBitsToUint(g.nearness) & ~0xffu | tone);
}

guide guide_of_words(uvec2 words)
{
    int bytes = int(words.x);
    vec4 parts = vec4(bytes << 24 >> 24, bytes << 16 >> 24, bytes << 8 >> 24, bytes >> 24) / 127.0;
    return guide(parts.xyz, parts.w, uintBitsToFloat(words.y & ~0xffu), float(words.y & 0xffu) / 255.0);
}

// Words of a pixel's motion, as a share of its depth.
uvec2 words_of_motion(vec3 motion)
{
    bool known = max_component(abs(motion)) < HALF_FLOAT_MAX;
    motion = known ? motion : vec3(0.0);
    return uvec2(packHalf2x16(motion.xy), packHalf2x16(vec2(motion.z, known ? 0.0 : 1.0)));
}

// Motion of a pixel. False: unknown.
bool motion_of_words(uvec2 words, out vec3 motion)
{
    vec2 last = unpackHalf2x16(words.y);
    motion = vec3(unpackHalf2x16(words.x), last.x);
    return last.y == 0.0;
}

// Pixel of this invocation in the strip. False: it has none.
bool pixel_of_item(out ivec2 pixel)
{
    uint k = item_index(), row = quotient(k, frame.width);
    pixel = ivec2(k - row * frame.width, first_row + row);
    return k < item_count;
}

int place_of(ivec2 pixel)
{
    return pixel.y * int(frame.width) + pixel.x;
}

// Bounds of the strip's pixels that belong to the same view as this one: the first, and the one behind the last.
void bounds_of(ivec2 pixel, out ivec2 lower, out ivec2 upper)
{
    ivec2 first = ivec2(view_of_pixel(uvec2(pixel.x, uint(pixel.y) + strip_row)) *
                        uvec2(frame.view_width, frame.view_height)) - ivec2(0, int(strip_row));
    lower = max(first, ivec2(0));
    upper = min(first + ivec2(frame.view_width, frame.view_height), ivec2(frame.width, strip_rows));
}

bool within(ivec2 pixel, ivec2 lower, ivec2 upper)
{
    return all(greaterThanEqual(pixel, lower)) && all(lessThan(pixel, upper));
}

// Twice 1 - cos of the angle between unit normals.
float turn_of(guide own, guide other)
{
    vec3 apart = own.normal - other.normal;
    return dot(apart, apart);
}

// Whether light falls alike on a neighbour's surface.
bool is_alike(guide own, guide other)
{
    return min(own.nearness, other.nearness) > 0.0 && turn_of(own, other) < 0.4;
}

// Distance of a neighbour from the surface that the pixel sees, 0 and up; within one surface it is at most about 1.
// `slope` is that of the nearness, per pixel, as a share of it.
float off_surface(guide own, vec2 slope, guide other, vec2 offset)
{
    float expected = own.nearness * (1.0 + dot(slope, offset));
    float tolerance = own.nearness * (dot(abs(slope), abs(offset)) + DENOISE_DEPTH_SHARE);
    return abs(other.nearness - expected) / max(tolerance, 1e-30) + 0.5 * DENOISE_NORMAL_SCALE * turn_of(own, other);
}
