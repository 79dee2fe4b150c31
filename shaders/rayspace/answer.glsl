// SPDX-License-Identifier: MIT
// What is known of the rays of a wave: rayspace/layout.h, RAYSPACE_ANSWER_BYTES.
//
// Defines: ANY_HIT.
#include "common/optical_depth.glsl"
#include "rayspace/layout.h"
#include "shared/bindings.h"

layout(std430, binding = BIND_RAYSPACE_ANSWERS) buffer answer_block { uvec4 answers[]; };

// Order as the floats do, also negative ones.
uint ordered_bits(float value)
{
    uint bits = floatBitsToUint(value);
    return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}

float float_of_ordered(uint bits)
{
    return uintBitsToFloat((bits & 0x80000000u) != 0u ? bits & 0x7fffffffu : ~bits);
}

// How far a ray needs to go on, at most `t_max`; if nothing can change its answer, before its begin.
float distance_left(uint ray, float t_max)
{
#ifdef ANY_HIT
    uvec4 depth = answers[ray];
    return min(depth.x, min(depth.y, depth.z)) >= uint(OPTICAL_DEPTH_BLACK) ? -3e38 : t_max;
#else
    uint nearest = answers[ray].x;
    return nearest == 0xffffffffu ? t_max : min(t_max, float_of_ordered(nearest));
#endif
}
