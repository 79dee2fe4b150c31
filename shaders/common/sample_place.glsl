// SPDX-License-Identifier: MIT
// Place in its view of one of a pixel's current samples, in pixels from the top left, if nothing is rasterised.
//
// Defines: SPREAD each pixel places its samples by its own random numbers; else they are in its middle.
#include "common/camera.glsl"
#include "common/sequence.glsl"

float filter_place(int i)
{
    return frame_in_block.filter_places[i >> 2][i & 3];
}

// Offset of a sample from its pixel's centre, in pixels, by server/render/picture/pixel_filter.h.
float filter_offset(float number)
{
    float side = 2.0 * number - 1.0, at = sqrt(1.0 - abs(side)) * 64.0;
    int i = min(int(at), 63);
    float place = mix(filter_place(i), filter_place(i + 1), at - float(i));
    return side < 0.0 ? -place : place;
}

vec2 place_of_sample(uvec2 in_view, uint sample_)
{
    vec2 middle = vec2(in_view) + 0.5;
#ifdef SPREAD
    uvec2 seed = sequence_seed(in_view, frame.seed);
    vec2 u = sequence_pair(seed, SEQUENCE_PIXEL, frame.sample_index + sample_);
    return middle + vec2(filter_offset(u.x), filter_offset(u.y));
#else
    return middle;
#endif
}
