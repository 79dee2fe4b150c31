// SPDX-License-Identifier: MIT
// A texel of an A-buffer: the samples of its column, and the winding at a point of it (the number of bodies around the
// point).
//
// A sample stands for the plane through it, within its texel: a depth alone would turn every slope into steps.
#include "abuffer/layout.h"
#include "raster/layout.h"
#include "shared/bindings.h"
#include "common/cell_ray.glsl"

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer abuffer_texels;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer abuffer_samples; // two per texel

uniform int abuffer_resolution;

// Maximum deviation of a plane from its sample's depth within its texel and the slack, in cells. Steeper planes are
// clamped to it.
const float SPAN = (1.0 + 2.0 * ABUFFER_SLACK) / AXES_OVERLAP;

struct column {
    int first, end;
};

column column_at(int axis, ivec2 texel)
{
    uint tiles_along = ABUFFER_TILES_ALONG(uint(abuffer_resolution));
    uvec2 place = uvec2(texel);
    uvec2 words = texelFetch(abuffer_texels, int(ABUFFER_TEXEL(tiles_along, uint(axis), place.x, place.y))).xy;
    return column(int(words.x), int(words.x + words.y));
}

ivec2 texel_of(vec2 p)
{
    return clamp(ivec2(p), ivec2(0), ivec2(abuffer_resolution - 1));
}

struct column_sample {
    float depth;
    vec3 normal; // u v depth, of any length
    int step_;   // change of the winding behind the sample, towards greater depths
    int behind;  // winding behind the sample
};

uvec2 words_at(int index)
{
    uvec4 two = texelFetch(abuffer_samples, index >> 1);
    return (index & 1) == 0 ? two.xy : two.zw;
}

float depth_of(uvec2 words)
{
    return uintBitsToFloat(words.x);
}

column_sample sample_of(uvec2 words, int axis)
{
    vec2 p = vec2(bitfieldExtract(int(words.y), 0, 12), bitfieldExtract(int(words.y), 12, 12)) * (1.0 / 2047.0);
    vec3 normal = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
    normal.xy = normal.z < 0.0 ? folded : normal.xy;
    column_sample s;
    s.depth = depth_of(words);
    s.normal = in_image(normal, axis);
    s.step_ = (words.y & ABUFFER_SAMPLE_BODY) == 0u ? 0 : s.normal.z < 0.0 ? 1 : -1;
    s.behind = int(words.y >> ABUFFER_WINDING_SHIFT & ABUFFER_WINDING_MASK) - ABUFFER_WINDING_ZERO;
    return s;
}

// Depth of the sample's plane at an offset from the texel's centre.
float plane_depth(column_sample s, vec2 from_middle)
{
    float shift = -dot(s.normal.xy, from_middle) / s.normal.z;
    // The order of the comparisons gives NaN a defined result.
    return s.depth + (shift < SPAN ? shift > -SPAN ? shift : -SPAN : SPAN);
}

// Scan of the samples of a column from a depth on, in order.
struct column_scan {
    int next, end;
    int bound; // upper bound of the first sample's index
};

// Bisection stops at this number of samples before the first one, where a linear search is as fast.
const int PASSED = 4;

column_scan scan_of(column c)
{
    return column_scan(c.first, c.end, c.end);
}

// Runs a round of a loop that ends at next == end. True: it reached a sample, whose words are in `words`. Bisection runs
// as rounds of the same loop, so that columns without it do not wait for code that they skip.
bool scan(inout column_scan c, float depth_min, out int index, out uvec2 words)
{
    bool is_far = c.bound - c.next > PASSED;
    int at = is_far ? (c.next + c.bound) >> 1 : c.next;
    uvec4 two = texelFetch(abuffer_samples, at >> 1);
    bool is_even = (at & 1) == 0;
    bool is_before = uintBitsToFloat(is_even ? two.x : two.z) < depth_min;
    bool is_first = is_even && !is_before;
    index = is_first ? at : at | 1;
    words = is_first ? two.xy : two.zw;
    int passed = is_first ? at + 1 : (at | 1) + 1;
    c.next = is_far ? is_before ? at + 1 : c.next : passed;
    c.bound = is_far && !is_before ? at : c.bound;
    return !is_far && index < c.end && depth_of(words) >= depth_min;
}

// Winding at a point of a texel: the number of bodies around it.
int winding_at(int axis, ivec2 texel, vec3 p)
{
    vec2 from_middle = p.xy - vec2(texel) - 0.5;
    column_scan c = scan_of(column_at(axis, texel));
    int winding = 0; // behind all samples
    bool is_first = true, is_behind = false;
    do {
        int i;
        uvec2 words;
        if (scan(c, p.z - SPAN, i, words)) {
            column_sample s = sample_of(words, axis);
            winding = is_first ? s.behind - s.step_ : winding;
            is_first = false;
            is_behind = s.depth > p.z + SPAN;
            winding += !is_behind && plane_depth(s, from_middle) < p.z ? s.step_ : 0;
        }
    } while (c.next < c.end && !is_behind);
    return winding;
}
