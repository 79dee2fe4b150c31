// SPDX-License-Identifier: MIT
// Answers for the rays of a wave so far: rayspace/layout.h, RAYSPACE_ANSWER_BYTES.
//
// Defines: ANY_HIT.
#include "common/optical_depth.glsl"
#include "rayspace/layout.h"
#include "shared/bindings.h"

layout(std430, binding = BIND_RAYSPACE_ANSWERS) buffer answer_block { uvec4 answers[]; };

// Bits that have the order of the floats, also of negative ones.
uint ordered_bits(float value)
{
    uint bits = floatBitsToUint(value);
    return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}

float float_of_ordered(uint bits)
{
    return uintBitsToFloat((bits & 0x80000000u) != 0u ? bits & 0x7fffffffu : ~bits);
}

// Distance up to which a ray needs to be traced, at most `t_max`; before its beginning if nothing can change its answer.
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
