// SPDX-License-Identifier: MIT
// From fragments to leaves: who is in each, and sums of where and how.
// Define: SVO_PLANES
#include "common/dispatch.glsl"
#include "common/unit.glsl"
#include "svo/tree.glsl"

layout(binding = UNIT_SVO_FRAGMENTS) uniform usamplerBuffer fragments;
layout(binding = IMAGE_SVO_CURRENT, r32ui) readonly uniform uimageBuffer current;
layout(binding = IMAGE_SVO_IDS, r32ui) uniform uimageBuffer ids;
#ifdef SVO_PLANES
layout(binding = IMAGE_SVO_SUMS, r32i) uniform iimageBuffer sums;
#endif

uniform uint fragment_count;

void main()
{
    int k = int(item_index());
    if (uint(k) >= fragment_count)
        return;
    uvec4 fragment = texelFetch(fragments, k);
    bool is_high;
    int bit = grandchild_of(unpack_cell(fragment.x), 0, is_high);
    int leaf = child_place(texelFetch(records, int(imageLoad(current, k).x)), bit, is_high);
    imageAtomicMin(ids, leaf, fragment.y);
#ifdef SVO_PLANES
    ivec3 normal = ivec3(round(unpack_unit(fragment.z) * SVO_NORMAL_UNIT));
    for (int i = 0; i < 3; i++)
        imageAtomicAdd(sums, 4 * leaf + i, normal[i]);
    imageAtomicAdd(sums, 4 * leaf + 3, int(round(uintBitsToFloat(fragment.w) * SVO_DISTANCE_UNIT)) * SVO_SUM_COUNT + 1);
#endif
}
