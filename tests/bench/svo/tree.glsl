// SPDX-License-Identifier: MIT
// Records of the octree (svo/svo.h).
#include "svo/svo.h"

layout(binding = UNIT_SVO_RECORDS) uniform usamplerBuffer records;

// Which of a record's grandchildren a cell is in: those are cells of 2^shift. Bits 0..4: of its word; is_high: which.
int grandchild_of(ivec3 cell, int shift, out bool is_high)
{
    ivec3 q = (cell >> shift) & 3;
    is_high = q.z >= 2;
    return q.x | q.y << 2 | (q.z & 1) << 4;
}

int child_place(uvec4 record, int bit, bool is_high)
{
    uint word = is_high ? record.y : record.x;
    return int((is_high ? record.w : record.z) + uint(bitCount(word & ((1u << bit) - 1u))));
}

ivec3 unpack_cell(uint bits)
{
    return ivec3(bits, bits >> 10, bits >> 20) & 1023;
}
