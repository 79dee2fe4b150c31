// SPDX-License-Identifier: MIT
// Last step of a reduction: what was packed goes to the stack and to the leaves, or nowhere if it does not all fit.
//
// Defines: REDUCE_SEGMENTS it is packed segment by segment (section 4.1), else list by list.
#include "rayspace/reduce.glsl"

layout(binding = UNIT_RAYSPACE_SLOTS) uniform usamplerBuffer pairs_packed;
layout(std430, binding = BIND_RAYSPACE_PAIRS) writeonly buffer pair_block { uvec4 pairs_written[]; };
layout(std430, binding = BIND_RAYSPACE_PUT_OFF) writeonly buffer put_off_block { uvec4 pairs_put_off[]; };
layout(std430, binding = BIND_RAYSPACE_LEAVES) writeonly buffer leaf_block { uvec4 leaves_written[]; };
#ifdef REDUCE_SEGMENTS
layout(std430, binding = BIND_RAYSPACE_SEGMENTS) readonly buffer segment_block { uvec4 segments[]; };
#else
uniform uint list_slots; // that each list has room for
#endif

uniform uint to, later; // the stacks that are written to

void put(uint list, uint place, uint from)
{
    uvec4 pair = texelFetch(pairs_packed, int(from));
    if (list == RAYSPACE_LIST_LEAVES)
        leaves_written[control.leaves + place] = pair;
    else if (list == RAYSPACE_LIST_PUT_OFF)
        pairs_put_off[waiting_on(later) + place] = pair;
    else
        pairs_written[waiting_on(to) + place] = pair;
}

void main()
{
    uint self = gl_LocalInvocationIndex, first = first_segment(), end = slot_count();
    if (control.written > control.room || control.leaves_written > control.leaves_room ||
        control.put_off > control.put_off_room)
        return;
    for (uint segment = first; segment < first + GROUP_SEGMENTS; segment++) {
        uint begin = segment * RAYSPACE_SEGMENT;
        if (begin >= end)
            break;
#ifdef REDUCE_SEGMENTS
        uvec4 places = segments[segment];
        uint place = self, list = 0u;
        while (list < RAYSPACE_LISTS && place >= count_in(places.w, list)) {
            place -= count_in(places.w, list);
            list++;
        }
        if (list < RAYSPACE_LISTS)
            put(list, places[list] + place, begin + self);
#else
        uint place = begin + self;
        if (place < control.written)
            put(0u, place, place);
        if (place < control.leaves_written)
            put(1u, place, list_slots + place);
        if (place < control.put_off)
            put(2u, place, 2u * list_slots + place);
#endif
    }
}
