// SPDX-License-Identifier: MIT
// Tests rays against the primitives of leaves that they may meet, by the test of brute force (common/candidate.glsl). The
// choice among surfaces at one distance, too, does not depend on the order of the pairs. An invocation has a pair.
//
// Closest hits take three passes over the pairs, as the minimum rank is known only after the minimum distance. The
// defines of common/candidate.glsl, and:
//   LEAVES_TEST    the pair's nearest hit; the minimum distance of each ray
//   LEAVES_RANK    the minimum rank at that distance
//   LEAVES_SETTLE  the pair with that rank writes the hit
#include "common/dispatch.glsl"
#include "rayspace/control.glsl"
#include "rayspace/place.glsl"
#include "rayspace/leaf.glsl"

layout(std430, binding = BIND_RAYSPACE_LEAVES) buffer leaf_block { uvec4 leaves[]; };

void main()
{
    uint which = item_index();
    if (which >= control.leaves_taken)
        return;
    uvec4 pair = leaves[which];
    uint ray = ray_of_place(pair.x);
#ifdef LEAVES_TEST
#ifdef ANY_HIT
    test_leaf_any(pair, ray);
#else
    uvec2 nearest = test_leaf_closest(pair, ray);
    leaves[which].zw = uvec2(nearest.y, nearest.x);
    answers[ray].y = RAYSPACE_NO_RANK;
#endif
    atomicAdd(control.triangle_tests, triangle_tests);
    atomicAdd(control.cone_tests, box_tests);
#elif defined LEAVES_RANK
    if (pair.z != RAYSPACE_NO_RANK && pair.w == answers[ray].x)
        atomicMin(answers[ray].y, pair.z);
#else
    uvec4 answer = answers[ray];
    if (pair.z != RAYSPACE_NO_RANK && pair.w == answer.x && pair.z == answer.y &&
        (pair.w < answer.z || (pair.w == answer.z && pair.z < answer.w)))
        answers[ray].zw = pair.wz;
#endif
}
