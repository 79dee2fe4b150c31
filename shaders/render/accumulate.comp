// SPDX-License-Identifier: MIT
// Adds a slice to the picture, unless it must be done again: the samples of each pixel in their order.
// Defines: HAS_TILE_SAMPLES tiles may have stopped, and get no more samples (server/render/picture/noise.h).

#include "shared/path.h"
#include "common/dispatch.glsl"
#include "render/wave.glsl"

layout(local_size_x = 64) in;

uniform uint slot_count;
uniform uint first_slot; // first slot of the slice, in its band
uniform uint sample_shift;
uniform uint first_sum; // first sum of the slice's samples

#ifdef HAS_TILE_SAMPLES
uniform uint first_picture_slot; // first slot of the slice, in the picture
layout(binding = UNIT_TILE_SAMPLES) uniform usamplerBuffer tile_samples;
#endif

layout(std430, binding = BIND_SLICE_SUMS) readonly buffer sum_block { vec4 slice_sums[]; };
layout(std430, binding = BIND_ACCUMULATION) buffer accumulation_block { vec4 accumulation[]; };

void main()
{
    uint k = item_index();
    if (k >= slot_count || wave.stopped != 0u)
        return;
#ifdef HAS_TILE_SAMPLES
    if (texelFetch(tile_samples, int((first_picture_slot + k) / TILE_SLOTS)).x != 0u)
        return;
#endif
    vec4 sum = accumulation[first_slot + k];
    uint end = (k + 1u) << sample_shift;
    for (uint i = k << sample_shift; i < end; i++)
        sum += slice_sums[first_sum + i];
    accumulation[first_slot + k] = sum;
}
