// SPDX-License-Identifier: MIT
// Second: each block's count of children becomes the place of its first child. One group scans them all, each
// invocation a run of blocks.

#include "shared/path.h"
#include "shared/wave.h"

layout(local_size_x = COMPACT_SCAN_SIZE) in;

uniform uint block_count;

layout(std430, binding = BIND_BLOCK_OFFSETS) buffer offset_block { uvec2 block_offsets[]; };
layout(std430, binding = BIND_WAVE) writeonly buffer wave_block { wave_state wave; };

shared uvec2 sums[COMPACT_SCAN_SIZE];

void main()
{
    uint self = gl_LocalInvocationIndex;
    uint run = (block_count + COMPACT_SCAN_SIZE - 1u) / COMPACT_SCAN_SIZE;
    uint first = min(self * run, block_count), end = min(first + run, block_count);
    uvec2 sum = uvec2(0u);
    for (uint block = first; block < end; block++)
        sum += block_offsets[block];
    sums[self] = sum;
    barrier();
    if (self == 0u) {
        uvec2 total = uvec2(0u);
        for (int i = 0; i < COMPACT_SCAN_SIZE; i++) {
            uvec2 own = sums[i];
            sums[i] = total;
            total += own;
        }
        wave.ray_count = total.x;
        wave.pad0 = total.y; // shadow rays
    }
    barrier();
    uint place = sums[self].x;
    for (uint block = first; block < end; block++) {
        uint count = block_offsets[block].x;
        block_offsets[block].x = place;
        place += count;
    }
}
