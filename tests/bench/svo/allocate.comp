// SPDX-License-Identifier: MIT
// Places for what a level's records were marked with.
#include "common/dispatch.glsl"
#include "svo/svo.h"

layout(binding = IMAGE_SVO_RECORDS, rgba32ui) uniform uimageBuffer records;
layout(std430, binding = BIND_SVO_COUNTS) buffer counts_block { svo_counts counts; };

uniform uint first_record, record_count;

void main()
{
    uint k = item_index();
    if (k >= record_count)
        return;
    int place = int(first_record + k);
    uvec2 words = imageLoad(records, place).xy;
    uint low = uint(bitCount(words.x)), all = low + uint(bitCount(words.y));
    uint first = atomicAdd(counts.children, all);
    imageStore(records, place, uvec4(words, first, first + low));
}
