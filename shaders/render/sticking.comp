// SPDX-License-Identifier: MIT
// Writes the share of each sample of a slice that depends on the eye. It is sent as means of blocks of 4 x 4 pixels, so
// the first pixel of each 2 x 2, four consecutive slots, represents all of them.
//
// Defines: STICKS the integrator shows light that depends on the eye; those of common/material.glsl and
// common/light.glsl.

#include "shared/layers.h"
#include "common/sticking.glsl"
#include "render/shade.glsl"

uniform uint slot_count;
uniform uint first_sum; // first sum of the plane

layout(std430, binding = BIND_LAYER_SUMS) writeonly buffer layer_block { vec4 layer_sums[]; };

float share_of(uint k)
{
#ifdef STICKS
    hit h = hit_at(k);
    if (h.distance >= 0.0) {
        ray r = ray_at(k);
        return sticking_of(surface_of_path(path_at(k), h, r), r.direction_t_max.xyz);
    }
#endif
    return 0.0;
}

void main()
{
    uint item = item_index(), shift = frame.sample_shift, sample_ = item & (1u << shift) - 1u;
    // Groups of four slots in the picture; a slice may begin or end within one.
    uint four = 4u * ((first_slot >> 2) + (item >> shift));
    uint begin = max(four, first_slot) - first_slot, end = min(four + 4u - first_slot, slot_count);
    if (begin >= end)
        return;
    float share = share_of(begin << shift | sample_);
    for (uint slot = begin; slot < end; slot++)
        layer_sums[first_sum + (slot << shift | sample_)] = vec4(vec3(share), 1.0);
}
