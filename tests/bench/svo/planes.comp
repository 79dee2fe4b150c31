// SPDX-License-Identifier: MIT
// From a leaf's sums to its plane.
#include "common/dispatch.glsl"
#include "svo/plane.glsl"

layout(binding = IMAGE_SVO_SUMS, r32i) readonly uniform iimageBuffer sums;
layout(binding = IMAGE_SVO_PLANES, r32ui) writeonly uniform uimageBuffer planes;

uniform uint leaf_count;

// Of the normals, so much must be left over: of two sides of a sheet nothing is.
const float AGREE_MIN = 0.3;

void main()
{
    int k = int(item_index());
    if (uint(k) >= leaf_count)
        return;
    ivec4 sum;
    for (int i = 0; i < 4; i++)
        sum[i] = imageLoad(sums, 4 * k + i).x;
    float count = float(sum.w & (SVO_SUM_COUNT - 1)), distance_ = float(sum.w >> 12) / SVO_DISTANCE_UNIT;
    vec3 normal = vec3(sum.xyz) / SVO_NORMAL_UNIT;
    float long_ = length(normal);
    uint plane = long_ < AGREE_MIN * count ? SVO_NO_PLANE : pack_plane(normal / long_, distance_ / count);
    imageStore(planes, k, uvec4(plane));
}
