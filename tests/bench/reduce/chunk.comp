// SPDX-License-Identifier: MIT
// Stream reduction by chunks, as rayspace/descend.comp does it of what it has just tested: an invocation looks through a
// run of slots, and asks once for places for all that are not empty.
#include "common/dispatch.glsl"
#include "rayspace/reduce.h"
#include "shared/bindings.h"

layout(binding = UNIT_RAYSPACE_SLOTS) uniform usamplerBuffer slots;
layout(std430, binding = BIND_RAYSPACE_CONTROL) buffer control_block { rayspace_control control; };
layout(std430, binding = BIND_RAYSPACE_PAIRS) writeonly buffer pair_block { uvec4 pairs_written[]; };

uniform uint slot_count;

void main()
{
    uint begin = item_index() * RAYSPACE_CHUNK_SLOTS;
    if (begin >= slot_count)
        return;
    uint mask = 0u;
    for (uint i = 0u; i < RAYSPACE_CHUNK_SLOTS; i++)
        mask |= texelFetch(slots, int(begin + i)).w != RAYSPACE_SLOT_EMPTY ? 1u << i : 0u;
    uint kept_count = uint(bitCount(mask));
    uint place = kept_count > 0u ? atomicAdd(control.written, kept_count) : 0u;
    if (place + kept_count > control.room)
        return;
    for (; mask != 0u; mask &= mask - 1u)
        pairs_written[place++] = texelFetch(slots, int(begin) + findLSB(mask));
}
