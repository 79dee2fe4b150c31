// SPDX-License-Identifier: MIT
// A tile of eight children for each node of a level that holds something.
#include "common/dispatch.glsl"
#include "svo/svo.h"

layout(binding = IMAGE_SVO_RECORDS, r32ui) uniform uimageBuffer nodes;
layout(std430, binding = BIND_SVO_COUNTS) buffer counts_block { svo_counts counts; };

uniform uint first_record, record_count;

void main()
{
    uint k = item_index();
    if (k < record_count && imageLoad(nodes, int(first_record + k)).x == SVO_HOLDS)
        imageStore(nodes, int(first_record + k), uvec4(SVO_HOLDS | atomicAdd(counts.children, 8u)));
}
