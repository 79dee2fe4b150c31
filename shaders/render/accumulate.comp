// SPDX-License-Identifier: MIT
// Adds a finished slice to the picture.

#include "shared/path.h"
#include "common/dispatch.glsl"

layout(local_size_x = 64) in;

uniform uint slot_count;
uniform uint first_slot; // of the slice, in its band

layout(std430, binding = BIND_SLICE_PIXELS) readonly buffer pixel_block { vec4 slice_pixels[]; };
layout(std430, binding = BIND_ACCUMULATION) buffer accumulation_block { vec4 accumulation[]; };

void main()
{
    uint k = item_index();
    if (k < slot_count)
        accumulation[first_slot + k] += slice_pixels[k];
}
