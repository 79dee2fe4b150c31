// SPDX-License-Identifier: MIT
// The primitives of a leaf against a ray.
#include "rayspace/answer.glsl"
#include "rayspace/ray.glsl"
#include "common/candidate.glsl"
#include "tree/layout.h"

layout(binding = UNIT_TRACER_1) uniform usamplerBuffer tree_transforms;
layout(binding = UNIT_TRACER_2) uniform usamplerBuffer tree_primitives;
layout(binding = UNIT_RAYSPACE_RANKS) uniform usamplerBuffer ranks;
#ifdef HAS_MOTION
layout(binding = UNIT_RAY_TIMES) uniform samplerBuffer ray_times;
#endif

trace_ray trace_ray_of(uint ray)
{
    vec4 origin_t_min = texelFetch(rays, int(2u * ray)), direction_t_max = texelFetch(rays, int(2u * ray + 1u));
    trace_ray r;
    r.origin = origin_t_min.xyz;
    r.direction = direction_t_max.xyz;
    r.t_min = origin_t_min.w;
    r.t_max = direction_t_max.w;
#ifdef HAS_MOTION
    r.time = texelFetch(ray_times, int(ray)).x;
#endif
    return r;
}

// The tree's primitive i of an instance: its number in its geometry.
uint number_of(uint instance_index, uint i, bool is_sphere)
{
    uint first = texelFetch(tree_transforms, int(instance_index) * BVH_TRANSFORM_TEXELS + 5).z;
#ifdef HAS_SPHERES
    if (is_sphere)
        return texelFetch(tree_primitives, int(first + i * BVH_SPHERE_TEXELS) + 1).x;
#endif
    return texelFetch(tree_primitives, int(first + i * BVH_TRIANGLE_TEXELS)).w;
}

#ifdef ANY_HIT

// Adds to the depths of a ray, up to the maximum, so that they cannot overflow.
void deepen(uint ray, uint channel, uint steps)
{
    uint expected = answers[ray][channel];
    while (steps > 0u && expected < DEPTH_MAX) {
        uint found = atomicCompSwap(answers[ray][channel], expected, min(expected + steps, DEPTH_MAX));
        if (found == expected)
            break;
        expected = found;
    }
}

void test_leaf_any(uint ray, uvec4 pair)
{
    trace_ray r = trace_ray_of(ray);
    if (distance_left(ray, r.t_max) < r.t_min)
        return;
    object_ray o = object_from_world_ray(r, pair.z);
    uint first = pair.y & BVH_LEAF_FIRST_MASK, count = (pair.y >> BVH_LEAF_COUNT_SHIFT & BVH_LEAF_COUNT_MASK) + 1u;
    uint first_primitive = texelFetch(tree_transforms, int(pair.z) * BVH_TRANSFORM_TEXELS + 5).w;
    bool is_sphere = pair.y >> BVH_LEAF_KIND_SHIFT == BVH_LEAF_SPHERES;
    vec3 depth = vec3(0.0);
    for (uint i = first; i < first + count; i++) {
        uint primitive = first_primitive + number_of(pair.z, i, is_sphere);
#ifdef HAS_SPHERES
        if (is_sphere)
            visit_sphere_any(r, o, primitive, pair.z, depth);
        else
#endif
            visit_triangle_any(r, o, primitive, pair.z, depth);
    }
    uvec3 steps = uvec3(depth);
    deepen(ray, 0u, steps.x);
    deepen(ray, 1u, steps.y);
    deepen(ray, 2u, steps.z);
}

#else

// The nearest hit: its distance, as ordered_bits(), and the rank.
uvec2 test_leaf_closest(uint ray, uvec4 pair)
{
    trace_ray r = trace_ray_of(ray);
    object_ray o = object_from_world_ray(r, pair.z);
    uint first = pair.y & BVH_LEAF_FIRST_MASK, count = (pair.y >> BVH_LEAF_COUNT_SHIFT & BVH_LEAF_COUNT_MASK) + 1u;
    uint first_primitive = texelFetch(tree_transforms, int(pair.z) * BVH_TRANSFORM_TEXELS + 5).w;
    uint first_rank = texelFetch(ranks, int(pair.z)).x;
    bool is_sphere = pair.y >> BVH_LEAF_KIND_SHIFT == BVH_LEAF_SPHERES;
    uvec2 nearest = uvec2(0xffffffffu, RAYSPACE_NO_RANK);
    for (uint i = first; i < first + count; i++) {
        uint number = number_of(pair.z, i, is_sphere);
        candidate best = candidate_none(r.t_max);
#ifdef HAS_SPHERES
        if (is_sphere)
            visit_sphere_closest(r, o, first_primitive + number, pair.z, best);
        else
#endif
            visit_triangle_closest(r, o, first_primitive + number, pair.z, best);
        uvec2 found = uvec2(ordered_bits(best.distance), first_rank + number);
        if (best.primitive != HIT_NO_PRIMITIVE &&
            (found.x < nearest.x || (found.x == nearest.x && found.y < nearest.y)))
            nearest = found;
    }
    return nearest;
}

#endif
