// SPDX-License-Identifier: MIT
// Last step of a reduction: copies the packed pairs to the stack and to the leaves, or to neither if they do not all fit.
#include "rayspace/reduce.glsl"

layout(binding = UNIT_RAYSPACE_SLOTS) uniform usamplerBuffer pairs_packed;
layout(std430, binding = BIND_RAYSPACE_PAIRS) writeonly buffer pair_block { uvec4 pairs_written[]; };
layout(std430, binding = BIND_RAYSPACE_LEAVES) writeonly buffer leaf_block { uvec4 leaves_written[]; };
layout(std430, binding = BIND_RAYSPACE_SEGMENTS) readonly buffer segment_block { uvec4 segments[]; };

uniform uint to; // number of the stack that is written

void put(uint list, uint place, uint from)
{
    uvec4 pair = texelFetch(pairs_packed, int(from));
    if (list == RAYSPACE_LIST_LEAVES)
        leaves_written[control.leaves + place] = pair;
    else
        pairs_written[waiting_on(to) + place] = pair;
}

void main()
{
    uint self = gl_LocalInvocationIndex, first = first_segment(), end = slot_count();
    if (control.written > control.room || control.leaves_written > control.leaves_room)
        return;
    for (uint segment = first; segment < first + GROUP_SEGMENTS; segment++) {
        uint begin = segment * RAYSPACE_SEGMENT;
        if (begin >= end)
            break;
        uvec4 places = segments[segment];
        uint place = self, list = 0u;
        while (list < RAYSPACE_LISTS && place >= count_in(places.w, list)) {
            place -= count_in(places.w, list);
            list++;
        }
        if (list < RAYSPACE_LISTS)
            put(list, places[list] + place, begin + self);
    }
}
