/* SPDX-License-Identifier: MIT */
/* Stream reduction in passes of its own (section 4 of the paper): an invocation of the descent has a fixed run of
 * slots for what it keeps of its pairs, then the slots that are empty are taken out. */
#ifndef FARLIGHT_SHADERS_RAYSPACE_REDUCE_H
#define FARLIGHT_SHADERS_RAYSPACE_REDUCE_H
#include "rayspace/layout.h"

#define RAYSPACE_CHUNK_SLOTS (RAYSPACE_CHUNK * (RAYSPACE_CHILDREN + 1u))
#define RAYSPACE_SEGMENT 64u /* slots that are reduced together: the size that the paper found best */

/* A slot is a pair, RGBA32UI, whose last word says to which list it goes: these, or to the other stack. */
#define RAYSPACE_SLOT_EMPTY 0xffffffffu
#define RAYSPACE_SLOT_LEAF 0xfffffffeu
#define RAYSPACE_LIST_PAIRS 0u
#define RAYSPACE_LIST_LEAVES 1u
#define RAYSPACE_LISTS 2u

/* A segment, once it is reduced: its pairs of each list lie behind one another at its beginning. Words:
 *   x, y  places of the first of each in their lists
 *   w     how many of each list there are, RAYSPACE_COUNT_BITS each */
#define RAYSPACE_SEGMENT_BYTES 16u
#define RAYSPACE_COUNT_BITS 8u
#define RAYSPACE_COUNT_MASK 0xffu

#define BIND_RAYSPACE_SLOTS BIND_RAYSPACE_PAIRS /* of the descent */
#define BIND_RAYSPACE_PACKED BIND_TRACER_1
#define BIND_RAYSPACE_SEGMENTS BIND_PASS_3
#define UNIT_RAYSPACE_SLOTS UNIT_RAYSPACE_PAIRS

#endif
