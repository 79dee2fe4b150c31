// SPDX-License-Identifier: MIT
// Returns the answer that the descent has found for a ray, after its discs are tested.
#include "common/candidate.glsl"
#include "rayspace/answer.glsl"
#include "rayspace/rank.glsl"

#ifdef ANY_HIT

bool trace_any(trace_ray r, inout vec3 optical_depth)
{
    optical_depth = min(optical_depth + vec3(answers[first_ray + item_index()].xyz), vec3(OPTICAL_DEPTH_MAX));
    return min_component(optical_depth) >= OPTICAL_DEPTH_BLACK;
}

#else

void trace_closest(trace_ray r, inout candidate best)
{
    uvec4 answer = answers[first_ray + item_index()];
    if (answer.w == RAYSPACE_NO_RANK || float_of_ordered(answer.z) >= best.distance)
        return;
    uint instance_index = instance_of_rank(answer.w);
    uint first_primitive = geometry_at(instance_at(instance_index).geometry).first_primitive;
    best = candidate(float_of_ordered(answer.z), first_primitive + answer.w - first_rank_of(instance_index),
                     instance_index, vec2(0.0));
}

#endif
