// SPDX-License-Identifier: MIT
// Which texels have lists, tile after tile: what is beside each other in an image lies together in what is made of it.

#include "shared/abuffer_build.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

uniform uint texels_along; // a side of the images

layout(binding = UNIT_ABUFFER_HEADS) uniform usamplerBuffer heads;
layout(binding = IMAGE_ABUFFER_OCCUPIED, r32ui) writeonly uniform uimageBuffer occupied;
layout(std430, binding = BIND_ABUFFER_BUILD_COUNTS) buffer build_block { abuffer_build_counts build; };

void main()
{
    uint tiles_u = (texels_along + ABUFFER_TILE_U - 1u) / ABUFFER_TILE_U;
    uint tiles_v = (texels_along + ABUFFER_TILE_V - 1u) / ABUFFER_TILE_V;
    uint row = item_index() / tiles_u, u = (item_index() - row * tiles_u) * ABUFFER_TILE_U;
    uint axis = row / tiles_v, v = (row - axis * tiles_v) * ABUFFER_TILE_V;
    if (axis > 2u)
        return;
    uint u_end = min(u + ABUFFER_TILE_U, texels_along), v_end = min(v + ABUFFER_TILE_V, texels_along);
    uint first_row = axis * texels_along, filled = 0u;
    for (uint y = v; y < v_end; y++)
        for (uint x = u; x < u_end; x++)
            filled += texelFetch(heads, int((first_row + y) * texels_along + x)).x != 0u ? 1u : 0u;
    if (filled == 0u)
        return;
    uint at = atomicAdd(build.occupied, filled);
    for (uint y = v; y < v_end; y++)
        for (uint x = u; x < u_end; x++) {
            uint texel = (first_row + y) * texels_along + x;
            if (texelFetch(heads, int(texel)).x != 0u)
                imageStore(occupied, int(at++), uvec4(texel));
        }
}
