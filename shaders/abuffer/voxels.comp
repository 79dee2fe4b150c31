// SPDX-License-Identifier: MIT
// Turns the sums of each voxel's samples into the voxel that rays read (abuffer/layout.h); raster/reach.comp then adds
// the empty space round empty blocks. One invocation per block.
#include "abuffer/layout.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

layout(binding = IMAGE_ABUFFER_VOXELS, rgba32ui) uniform uimageBuffer voxels;
layout(binding = IMAGE_ABUFFER_SUBVOXELS, rg32ui) uniform uimageBuffer subvoxels;

uniform int grid; // blocks along a side
uniform bool has_subvoxels;
uniform bool without_steep; // no image has samples that are steep in it, and no normals are summed
uniform uint first_item, end_item; // blocks of the pass

layout(binding = UNIT_TRACER_0) uniform isamplerBuffer sums; // a voxel's four sums as one texel

// ABUFFER_VOXEL_* bits of a voxel with these sums; 0: it is empty.
uint judged(ivec4 sum)
{
    uint bits = uint(sum.w), leaned = bits & ABUFFER_VOXEL_IMAGES;
    if (bits == 0u)
        return 0u;
    if (without_steep) { // an image that shows the whole voxel, or those that show something best
        uint whole = leaned & ~(bits / ABUFFER_SUM_STEEP);
        return whole != 0u ? 1u << findLSB(whole) : leaned;
    }
    vec3 average = abs(vec3(sum.xyz));
    uint first = average.x >= average.y && average.x >= average.z ? 0u : average.y >= average.z ? 1u : 2u;
    // The normals of a thin body's two sides cancel out.
    first = bitCount(leaned) == 1 ? uint(findLSB(leaned)) : first;
    bool shows_all = (bits & ABUFFER_SUM_STEEP << first) == 0u;
    bool is_thin = (bits / ABUFFER_SUM_UP & bits / ABUFFER_SUM_DOWN & 7u) != 0u;
    uint body = (bits & ABUFFER_SUM_OPEN) == 0u && !is_thin ? ABUFFER_VOXEL_BODY : 0u;
    return body | (shows_all ? 1u << first : leaned);
}

int voxel_at(ivec3 place, int i)
{
    ivec3 voxel = 4 * place + ivec3(i & 3, i >> 2 & 3, i >> 4);
    return (voxel.z * 4 * grid + voxel.y) * 4 * grid + voxel.x;
}

void join_subvoxels(int voxel)
{
    int first = ABUFFER_SUBVOXELS_TEXELS * voxel;
    uvec4 any_ = imageLoad(subvoxels, first) | imageLoad(subvoxels, first + 1) | imageLoad(subvoxels, first + 2);
    imageStore(subvoxels, first + ABUFFER_SUBVOXELS_ANY, any_);
}

void settle(int at, ivec3 place)
{
    uvec2 occupied = uvec2(0u);
    for (int half_ = 0; half_ < 2; half_++) {
        uvec4 words = uvec4(0u);
        uint holds = 0u;
        for (int i = 0; i < 32; i++) {
            uint what = judged(texelFetch(sums, voxel_at(place, 32 * half_ + i)));
            uint nibble = what << 4 * (i & 7);
            uvec4 part = uvec4(equal(ivec4(i >> 3), ivec4(0, 1, 2, 3)));
            words |= part * nibble;
            holds |= what != 0u ? 1u << i : 0u;
        }
        occupied[half_] = holds;
        imageStore(voxels, at + 1 + half_, words);
        // Empty voxels, as most are, have no subvoxels.
        for (uint left = has_subvoxels ? holds : 0u; left != 0u; left &= left - 1u)
            join_subvoxels(voxel_at(place, 32 * half_ + findLSB(left)));
    }
    imageStore(voxels, at, uvec4(occupied, 0u, 0u));
}

void main()
{
    uint block = first_item + item_index();
    if (block >= end_item)
        return;
    int item = int(block);
    settle(ABUFFER_BLOCK_TEXELS * item, ivec3(item % grid, item / grid % grid, item / (grid * grid)));
}
