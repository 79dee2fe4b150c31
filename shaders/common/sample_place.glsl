// SPDX-License-Identifier: MIT
// Where in its view one of a pixel's current samples is, in pixels from the top left.
//
// Defines: SPREAD each pixel has its samples where its own numbers say; else all have them where frame.sample_places says.
#include "common/camera.glsl"
#include "common/sequence.glsl"

vec2 place_of_sample(uvec2 in_view, uint sample_)
{
#ifdef SPREAD
    uint seed = sequence_seed(number_in_view(in_view), frame.seed);
    vec2 u = sequence_pair(seed, SEQUENCE_PIXEL, frame.sample_index + sample_);
    return vec2(in_view) + 0.5 + vec2(filter_offset(u.x), filter_offset(u.y));
#else
    return vec2(in_view) + sample_place(sample_);
#endif
}
