// SPDX-License-Identifier: MIT
// Second step of the reduction by segments: finds the places of each segment's pairs in their lists, and their total
// numbers. A single work group; an invocation has a run of segments.
#include "rayspace/reduce.glsl"

layout(std430, binding = BIND_RAYSPACE_SEGMENTS) buffer segment_block { uvec4 segments[]; };

shared uvec2 sums[GROUP_SIZE];

uvec2 counts_of(uint segment)
{
    uint counts = segments[segment].w;
    return uvec2(count_in(counts, 0u), count_in(counts, 1u));
}

void main()
{
    uint self = gl_LocalInvocationIndex, count = (slot_count() + RAYSPACE_SEGMENT - 1u) / RAYSPACE_SEGMENT;
    uint run = (count + GROUP_SIZE - 1u) / GROUP_SIZE, first = min(self * run, count), end = min(first + run, count);
    uvec2 sum = uvec2(0u);
    for (uint segment = first; segment < end; segment++)
        sum += counts_of(segment);
    sums[self] = sum;
    barrier();
    uvec2 place = uvec2(0u);
    for (uint before = 0u; before < self; before++)
        place += sums[before];
    if (self == GROUP_SIZE - 1u) {
        control.written = place.x + sum.x;
        control.leaves_written = place.y + sum.y;
    }
    for (uint segment = first; segment < end; segment++) {
        uvec2 own = counts_of(segment);
        segments[segment].xy = place;
        place += own;
    }
}
