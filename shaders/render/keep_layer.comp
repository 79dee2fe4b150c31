// SPDX-License-Identifier: MIT
// From the sums of a layer's picture, a band of it, to texels of the key view (shared/key_view.h).

#include "shared/key_view.h"
#include "common/camera.glsl"
#include "common/dispatch.glsl"

layout(local_size_x = 64) in;

uniform uint texel_count, first_texel; // of the band
uniform float scale;                   // 1 / samples
uniform uint shows_environment;        // where no surface is: 1 in the first layer

layout(std430, binding = BIND_ACCUMULATION) readonly buffer accumulation_block { vec4 accumulation[]; };
layout(std430, binding = BIND_KEY_DEPTHS) readonly buffer depth_block { vec4 depths[]; };
layout(std430, binding = BIND_KEY_LAYER) writeonly buffer key_block { vec4 key_layer[]; };

void main()
{
    uint k = item_index();
    if (k >= texel_count)
        return;
    uint slot = slot_of_pixel(uvec2(k % frame.width, k / frame.width));
    vec4 depth = depths[slot];
    float nothing = shows_environment != 0u ? KEY_INFINITE : KEY_NOTHING;
    key_layer[first_texel + k] = vec4(accumulation[slot].rgb * scale, depth.a > 0.0 ? depth.r : nothing);
}
