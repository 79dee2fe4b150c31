// SPDX-License-Identifier: MIT
// First step of the reduction by segments (section 4.1): moves the occupied slots of each segment to its beginning, list
// by list. An invocation has a segment: in log s steps of many invocations each would wait for the others, which takes
// four times as long on software GL.
#include "rayspace/reduce.glsl"

layout(binding = UNIT_RAYSPACE_SLOTS) uniform usamplerBuffer slots;
layout(std430, binding = BIND_RAYSPACE_PACKED) writeonly buffer packed_block { uvec4 pairs_packed[]; };
layout(std430, binding = BIND_RAYSPACE_SEGMENTS) writeonly buffer segment_block { uvec4 segments[]; };

void main()
{
    uint self = gl_LocalInvocationIndex, segment = first_segment() + self, begin = segment * RAYSPACE_SEGMENT;
    if (self >= GROUP_SEGMENTS || begin >= slot_count())
        return;
    uint end = min(begin + RAYSPACE_SEGMENT, slot_count()), counts = 0u;
    for (uint i = begin; i < end; i++) {
        uint last = texelFetch(slots, int(i)).w;
        if (last != RAYSPACE_SLOT_EMPTY)
            counts += 1u << list_of(last) * RAYSPACE_COUNT_BITS;
    }
    segments[segment] = uvec4(0u, 0u, 0u, counts);
    uint places[RAYSPACE_LISTS];
    places[0] = begin;
    for (uint list = 1u; list < RAYSPACE_LISTS; list++)
        places[list] = places[list - 1u] + count_in(counts, list - 1u);
    for (uint i = begin; i < end; i++) {
        uvec4 slot = texelFetch(slots, int(i));
        if (slot.w != RAYSPACE_SLOT_EMPTY)
            pairs_packed[places[list_of(slot.w)]++] = slot;
    }
}
