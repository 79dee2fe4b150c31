// SPDX-License-Identifier: MIT
// Slots of the current pass. A work group has the segments of RAYSPACE_CHUNK_SLOTS x 64 slots, which a work group of the
// descent has written.
#include "common/dispatch.glsl"
#include "rayspace/control.glsl"
#include "rayspace/reduce.h"

const uint GROUP_SEGMENTS = RAYSPACE_CHUNK_SLOTS * 64u / RAYSPACE_SEGMENT;

uint slot_count()
{
    return (control.taken + RAYSPACE_CHUNK - 1u) / RAYSPACE_CHUNK * RAYSPACE_CHUNK_SLOTS;
}

uint first_segment()
{
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * GROUP_SEGMENTS;
}

// List of a slot that is not empty.
uint list_of(uint last)
{
    return last == RAYSPACE_SLOT_LEAF ? RAYSPACE_LIST_LEAVES : RAYSPACE_LIST_PAIRS;
}

// Number of a list's pairs in a segment.
uint count_in(uint counts, uint list)
{
    return counts >> list * RAYSPACE_COUNT_BITS & RAYSPACE_COUNT_MASK;
}
