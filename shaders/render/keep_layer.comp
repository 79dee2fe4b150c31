// SPDX-License-Identifier: MIT
// Copies the sums of a layer's picture, a band of it, to texels of the key view (shared/key_view.h).
//
// Defines: HAS_TILES of render/tiles.glsl.

#include "shared/key_view.h"
#include "render/tiles.glsl"
#include "common/dispatch.glsl"

layout(local_size_x = 64) in;

uniform uint slot_count, first_slot; // the band's
uniform float scale;                   // 1 / samples
uniform uint shows_environment;        // 1 in the first layer: texels without a surface show the environment

layout(std430, binding = BIND_ACCUMULATION) readonly buffer accumulation_block { vec4 accumulation[]; };
layout(std430, binding = BIND_KEY_DEPTHS) readonly buffer depth_block { vec4 depths[]; };
layout(std430, binding = BIND_KEY_LAYER) writeonly buffer key_block { vec4 key_layer[]; };

void main()
{
    uint k = item_index();
    if (k >= slot_count)
        return;
    uvec2 pixel = pixel_of_picture_slot(first_slot + k);
    if (pixel.x >= frame.width || pixel.y >= frame.height)
        return;
    vec4 depth = depths[k];
    float nothing = shows_environment != 0u ? KEY_INFINITE : KEY_NOTHING;
    key_layer[pixel.y * frame.width + pixel.x] = vec4(accumulation[k].rgb * scale, depth.a > 0.0 ? depth.r : nothing);
}
