// SPDX-License-Identifier: MIT
// The primitives of a leaf against a ray.
//
// Defines: RAYSPACE_FLAT a leaf is one primitive.
#include "common/candidate.glsl"
#include "rayspace/answer.glsl"
#include "rayspace/item.glsl"
#include "rayspace/rank.glsl"
#include "rayspace/trace_ray.glsl"
#include "tree/layout.h"

#ifndef RAYSPACE_FLAT
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer tree_transforms;
layout(binding = UNIT_TRACER_2) uniform usamplerBuffer tree_primitives;
#endif

struct leaf_range {
    uint instance_index, first_primitive;
    uint first, end; // in the order of the tree; of one primitive: its number in its geometry
    bool is_sphere;
};

leaf_range leaf_of(uvec4 pair)
{
    leaf_range leaf;
#ifdef RAYSPACE_FLAT
    leaf.instance_index = instance_of_item(pair.y);
    geometry g = geometry_at(instance_at(leaf.instance_index).geometry);
    leaf.first_primitive = g.first_primitive;
    leaf.first = number_of_item(pair.y);
    leaf.end = leaf.first + 1u;
    leaf.is_sphere = g.kind == GEOMETRY_SPHERES;
#else
    leaf.instance_index = pair.z;
    leaf.first_primitive = texelFetch(tree_transforms, int(pair.z) * BVH_TRANSFORM_TEXELS + 5).w;
    leaf.first = pair.y & BVH_LEAF_FIRST_MASK;
    leaf.end = leaf.first + (pair.y >> BVH_LEAF_COUNT_SHIFT & BVH_LEAF_COUNT_MASK) + 1u;
    leaf.is_sphere = pair.y >> BVH_LEAF_KIND_SHIFT == BVH_LEAF_SPHERES;
#endif
    return leaf;
}

// The primitive i of a leaf: its number in its geometry.
uint number_of(leaf_range leaf, uint i)
{
#ifdef RAYSPACE_FLAT
    return i;
#else
    uint first = texelFetch(tree_transforms, int(leaf.instance_index) * BVH_TRANSFORM_TEXELS + 5).z;
#ifdef HAS_SPHERES
    if (leaf.is_sphere)
        return texelFetch(tree_primitives, int(first + i * BVH_SPHERE_TEXELS) + 1).x;
#endif
    return texelFetch(tree_primitives, int(first + i * BVH_TRIANGLE_TEXELS)).w;
#endif
}

#ifdef ANY_HIT

// Adds to the depths of a ray, up to the maximum, so that they cannot overflow.
void deepen(uint ray, uint channel, uint steps)
{
    uint expected = answers[ray][channel];
    while (steps > 0u && expected < uint(OPTICAL_DEPTH_MAX)) {
        uint found = atomicCompSwap(answers[ray][channel], expected, min(expected + steps, uint(OPTICAL_DEPTH_MAX)));
        if (found == expected)
            break;
        expected = found;
    }
}

void test_leaf_any(uint ray, leaf_range leaf)
{
    trace_ray r = trace_ray_of(ray);
    if (distance_left(ray, r.t_max) < r.t_min)
        return;
    object_ray o = object_from_world_ray(r, leaf.instance_index);
    vec3 depth = vec3(0.0);
    for (uint i = leaf.first; i < leaf.end; i++) {
        uint primitive = leaf.first_primitive + number_of(leaf, i);
#ifdef HAS_SPHERES
        if (leaf.is_sphere)
            visit_sphere_any(r, o, primitive, leaf.instance_index, depth);
        else
#endif
            visit_triangle_any(r, o, primitive, leaf.instance_index, depth);
    }
    uvec3 steps = uvec3(depth);
    deepen(ray, 0u, steps.x);
    deepen(ray, 1u, steps.y);
    deepen(ray, 2u, steps.z);
}

#else

// The nearest hit: its distance, as ordered_bits(), and the rank.
uvec2 test_leaf_closest(uint ray, leaf_range leaf)
{
    trace_ray r = trace_ray_of(ray);
    object_ray o = object_from_world_ray(r, leaf.instance_index);
    uint first_rank = first_rank_of(leaf.instance_index);
    uvec2 nearest = uvec2(0xffffffffu, RAYSPACE_NO_RANK);
    for (uint i = leaf.first; i < leaf.end; i++) {
        uint number = number_of(leaf, i);
        candidate best = candidate_none(r.t_max);
#ifdef HAS_SPHERES
        if (leaf.is_sphere)
            visit_sphere_closest(r, o, leaf.first_primitive + number, leaf.instance_index, best);
        else
#endif
            visit_triangle_closest(r, o, leaf.first_primitive + number, leaf.instance_index, best);
        uvec2 found = uvec2(ordered_bits(best.distance), first_rank + number);
        if (best.primitive != HIT_NO_PRIMITIVE &&
            (found.x < nearest.x || (found.x == nearest.x && found.y < nearest.y)))
            nearest = found;
    }
    return nearest;
}

#endif
