// SPDX-License-Identifier: MIT
// Decides whether the children of a wave are sorted by the signs of their directions: neighbours then traverse a
// structure in the same order, and more of it together. Their origins stay about as near to each other, as a sorted wave
// keeps the order of the pixels within an octant. A sample of the wave decides: blocks of neighbours, one per invocation.
// A wave that is coherent already, such as the reflection in a mirror, would be torn apart. Runs only where a hit has one
// child: the paths of a sample stay side by side.

#include "render/wave_counts.glsl"

// Number of blocks, of COMPACT_BLOCK each, whose octants are counted; smaller waves are not worth it.
const uint BLOCKS = 64u;
// Maximum number of octants in a block that stays unsorted. Measured on software GL at 146K triangles, without the
// sorting: bounces, with 4.5 octants a block, take 1.07 (bvh; its traversal alone 1.16), 1.08 (ldc) and 1.05 (abuffer) of
// the time of sorted ones, and 64 cells of their origins within an octant would gain 0.02 more; mirror reflections, with
// 2.1, take 1.06 (bvh) and 1.00 (ldc).
const float OCTANTS_MAX = 2.5;

layout(local_size_x = BLOCKS) in;

layout(std430, binding = BIND_CHILD_COUNTS) readonly buffer count_block { uint child_counts[]; };

shared uint octants[BLOCKS];

void main()
{
    uint self = gl_LocalInvocationIndex, hit_count = state.hits.count, found = 0u;
    uint first = uint(float(state.hit_blocks.count) * (float(self) / float(BLOCKS))) * COMPACT_BLOCK;
    for (uint j = first; j < min(first + COMPACT_BLOCK, hit_count); j++) {
        uint children = child_counts[j];
        if ((children & CHILDREN_MASK) != 0u)
            found |= 1u << (children >> CHILD_OCTANT_SHIFT & OCTANTS - 1u);
    }
    octants[self] = uint(bitCount(found));
    barrier();
    if (self != 0u)
        return;
    uint sum = 0u, with_children = 0u;
    for (uint i = 0u; i < BLOCKS; i++) {
        sum += octants[i];
        with_children += min(octants[i], 1u);
    }
    bool sorts = hit_count >= BLOCKS * COMPACT_BLOCK && float(sum) > OCTANTS_MAX * float(with_children);
    state.sorted = sorts ? 1u : 0u;
    state.all_sorted_waves += state.sorted;
}
