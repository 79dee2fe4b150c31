// SPDX-License-Identifier: MIT
// Third pass: moves the children to their places as rays and paths of the next wave, in the order of their parents, in a
// sorted wave within each octant. The host has reserved the space.
// Defines: HAS_TIMES something moves: rays have a time.

#include "shared/path.h"
#include "shared/ray.h"
#include "common/dispatch.glsl"
#include "render/wave.glsl"

layout(local_size_x = 64) in;

uniform uint children_a_hit; // capacity

layout(std430, binding = BIND_CHILD_COUNTS) readonly buffer count_block { uint child_counts[]; };
layout(std430, binding = BIND_BLOCK_OFFSETS) readonly buffer offset_block { uvec2 block_offsets[]; };
layout(binding = UNIT_MOVE_CHILDREN) uniform usamplerBuffer children;
layout(std430, binding = BIND_RAYS) writeonly buffer ray_block { ray rays[]; };
layout(std430, binding = BIND_PATHS) writeonly buffer path_block { uvec4 paths[]; }; // PATH_TEXELS each
#ifdef HAS_TIMES
layout(std430, binding = BIND_RAY_TIMES) writeonly buffer time_block { float times[]; };
#endif

void main()
{
    uint j = item_index();
    // No children move where the wave does not fit, as their places do not exist.
    if (j >= wave.hits.count || wave.rays.count == 0u)
        return;
    uint own = child_counts[j], count = own & CHILDREN_MASK;
    if (count == 0u)
        return;
    uint octant_mask = wave.sorted != 0u ? OCTANTS - 1u << CHILD_OCTANT_SHIFT : 0u;
    uint octant = (own & octant_mask) >> CHILD_OCTANT_SHIFT, block = j / COMPACT_BLOCK;
    uint place = block_offsets[octant * wave.hit_blocks.count + block].x;
    for (uint k = block * COMPACT_BLOCK; k < j; k++) {
        uint before = child_counts[k];
        place += ((before ^ own) & octant_mask) == 0u ? before & CHILDREN_MASK : 0u;
    }
    for (uint i = 0u; i < count; i++) {
        int texel = int(j * children_a_hit + i) * CHILD_TEXELS;
        rays[place + i] = ray(uintBitsToFloat(texelFetch(children, texel)), uintBitsToFloat(texelFetch(children, texel + 1)));
        uvec4 second = texelFetch(children, texel + 3);
        paths[(place + i) * uint(PATH_TEXELS)] = texelFetch(children, texel + 2);
        paths[(place + i) * uint(PATH_TEXELS) + 1u] = second;
        paths[(place + i) * uint(PATH_TEXELS) + 2u] = texelFetch(children, texel + 4);
#ifdef HAS_TIMES
        times[place + i] = uintBitsToFloat(second.w);
#endif
    }
}
