/* SPDX-License-Identifier: MIT */
/* Stream reduction in separate passes (section 4 of the paper): an invocation of the descent has a fixed run of
 * slots for the pairs that it keeps; then empty slots are removed. */
#ifndef FARLIGHT_SHADERS_RAYSPACE_REDUCE_H
#define FARLIGHT_SHADERS_RAYSPACE_REDUCE_H
#include "rayspace/layout.h"

#define RAYSPACE_CHUNK_SLOTS (RAYSPACE_CHUNK * (RAYSPACE_CHILDREN + 1u))
#define RAYSPACE_SEGMENT 64u /* slots reduced together: the paper's best size */

/* A slot holds a pair, RGBA32UI, whose last word names its list: one of these, or else the other stack. */
#define RAYSPACE_SLOT_EMPTY 0xffffffffu
#define RAYSPACE_SLOT_LEAF 0xfffffffeu
#define RAYSPACE_LIST_PAIRS 0u
#define RAYSPACE_LIST_LEAVES 1u
#define RAYSPACE_LISTS 2u

/* A segment after its reduction: its pairs lie at its beginning, list by list. Words:
 *   x, y  places of the first pair of each list in that list
 *   w     number of pairs of each list, RAYSPACE_COUNT_BITS each */
#define RAYSPACE_SEGMENT_BYTES 16u
#define RAYSPACE_COUNT_BITS 8u
#define RAYSPACE_COUNT_MASK 0xffu

#define BIND_RAYSPACE_SLOTS BIND_RAYSPACE_PAIRS /* written by the descent */
#define BIND_RAYSPACE_PACKED BIND_TRACER_1
#define BIND_RAYSPACE_SEGMENTS BIND_PASS_3
#define UNIT_RAYSPACE_SLOTS UNIT_RAYSPACE_PAIRS

#endif
