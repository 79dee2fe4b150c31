// SPDX-License-Identifier: MIT
// Second pass: each block's count becomes the place of its first item. A single group scans all blocks, each invocation a
// run of them. The sums are the wave's new counts.
// Defines:
//   HITS  blocks are of rays, whose hits are counted; otherwise of hits, whose children are the next wave

#include "render/wave_counts.glsl"

layout(local_size_x = COMPACT_SCAN_SIZE) in;

#ifndef HITS
uniform uint capacity;    // rays that fit the buffers
uniform uint last_queued; // 1: no wave is queued after this one
#endif

layout(std430, binding = BIND_BLOCK_OFFSETS) buffer offset_block { uvec2 block_offsets[]; };

shared uvec2 sums[COMPACT_SCAN_SIZE];

#ifdef HITS

void take(uvec2 total)
{
    uint count = state.stopped == 0u ? total.x : 0u;
    state.hits = counts_of(count);
    state.hit_blocks = blocks_of(count);
}

#else

void take(uvec2 total)
{
    uint count = total.x;
    if (state.stopped == 0u && count > 0u)
        state.stopped = count > capacity ? WAVE_STOPPED_FULL : last_queued != 0u ? WAVE_STOPPED_QUEUED : 0u;
    if (state.stopped != 0u)
        count = 0u;
    state.rays = counts_of(count);
    state.ray_blocks = blocks_of(count);
    state.all_secondary_rays += count;
    state.all_shadow_rays += total.y;
}

#endif

// Sum over the invocations before this one, and over all.
void add_up(uint self, uvec2 own, out uvec2 before, out uvec2 total)
{
    sums[self] = own;
    barrier();
    for (uint reach = 1u; reach < COMPACT_SCAN_SIZE; reach <<= 1) {
        uvec2 more = self >= reach ? sums[self - reach] : uvec2(0u);
        barrier();
        sums[self] += more;
        barrier();
    }
    before = sums[self] - own;
    total = sums[COMPACT_SCAN_SIZE - 1];
}

void main()
{
    uint self = gl_LocalInvocationIndex;
#ifdef HITS
    uint block_count = state.ray_blocks.count;
#else
    uint block_count = state.hit_blocks.count * (state.sorted != 0u ? OCTANTS : 1u); // octant by octant
#endif
    uint run = (block_count + COMPACT_SCAN_SIZE - 1u) / COMPACT_SCAN_SIZE;
    uint first = min(self * run, block_count), end = min(first + run, block_count);
    uvec2 sum = uvec2(0u);
    for (uint block = first; block < end; block++)
        sum += block_offsets[block];
    uvec2 before, total;
    add_up(self, sum, before, total);
    if (self == 0u)
        take(total);
    uint place = before.x;
    for (uint block = first; block < end; block++) {
        uint count = block_offsets[block].x;
        block_offsets[block].x = place;
        place += count;
    }
}
