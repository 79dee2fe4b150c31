// SPDX-License-Identifier: MIT
// A ray against the primitives that a pair leads to.
//
// Defines: RAYSPACE_FLAT a pair leads to one primitive; else to a part of a tree (rayspace/subtree.glsl).
#include "common/candidate.glsl"
#include "rayspace/answer.glsl"
#include "rayspace/item.glsl"
#include "rayspace/rank.glsl"
#include "rayspace/trace_ray.glsl"
#ifndef RAYSPACE_FLAT
#include "rayspace/subtree.glsl"

layout(binding = UNIT_TRACER_2) uniform usamplerBuffer tree_primitives;
#endif

// The ray of a pair in the pair's instance.
struct leaf_ray {
    trace_ray world;
    object_ray object;
    uint ray;
    uint instance_index, first_primitive;
};

uint triangle_tests = 0u, box_tests = 0u;

#ifdef ANY_HIT

// The optical depth of what the pair leads to.
#define pair_answer vec3

bool is_done(pair_answer found)
{
    return min_component(found) >= OPTICAL_DEPTH_BLACK;
}

float end_of(leaf_ray r, pair_answer found)
{
    return r.world.t_max;
}

void offer(leaf_ray r, candidate hit, inout pair_answer found)
{
    offer_any(r.world, hit, found);
}

#else

struct pair_answer {
    uint distance, rank; // of the pair's nearest hit: ordered_bits(), and RAYSPACE_NO_RANK
    uint known;          // the distance of the ray's nearest hit so far, likewise
};

bool is_done(pair_answer found)
{
    return false;
}

// How far the ray needs to go on: hits at one distance count too, as ranks decide among them.
float end_of(leaf_ray r, pair_answer found)
{
    float end = found.known == 0xffffffffu ? r.world.t_max : min(r.world.t_max, float_of_ordered(found.known));
    return end + abs(end) * (PRUNE_SLACK - 1.0);
}

void offer(leaf_ray r, candidate hit, inout pair_answer found)
{
    uint distance_ = ordered_bits(hit.distance);
    if (distance_ > found.known)
        return;
    candidate best = candidate_none(r.world.t_max);
    offer_closest(r.world, hit, best);
    uint rank = first_rank_of(r.instance_index) + hit.primitive - r.first_primitive;
    if (best.primitive == HIT_NO_PRIMITIVE || distance_ > found.distance ||
        (distance_ == found.distance && rank > found.rank))
        return;
    found.distance = distance_;
    found.rank = rank;
    found.known = min(distance_, atomicMin(answers[r.ray].x, distance_));
}

#endif

#ifdef HAS_SPHERES
void test_sphere(leaf_ray r, vec4 sphere, uint primitive, inout pair_answer found)
{
    vec2 distances;
    if (!intersect_sphere(r.object.origin, r.object.direction, sphere.xyz, sphere.w, distances))
        return;
    for (int side = 0; side < 2; side++)
        offer(r, candidate(side == 0 ? distances.x : distances.y, primitive, r.instance_index, vec2(0.0)), found);
}
#endif

void test_triangle(leaf_ray r, uint primitive, inout pair_answer found)
{
    candidate hit;
    if (intersect_primitive(r.world, r.object, primitive, r.instance_index, hit))
        offer(r, hit, found);
}

#ifdef RAYSPACE_FLAT

void test_pair(uvec4 pair, leaf_ray r, inout pair_answer found)
{
    geometry g = geometry_at(instance_at(r.instance_index).geometry);
    r.first_primitive = g.first_primitive;
    uint primitive = r.first_primitive + number_of_item(pair.y);
    triangle_tests++;
#ifdef HAS_SPHERES
    if (g.kind == GEOMETRY_SPHERES)
        test_sphere(r, texelFetch(spheres, int(primitive)), primitive, found);
    else
#endif
        test_triangle(r, primitive, found);
}

#else

// The primitive i in the order of the tree, which has a copy of its corners. As these are those of the shutter's opening,
// a shape that moves takes the geometry's own.
void test_in_order(leaf_ray r, subtree part, uint i, bool is_sphere, inout pair_answer found)
{
    triangle_tests++;
#ifdef HAS_SPHERES
    if (is_sphere) {
        int texel = int(part.first_texel + i * BVH_SPHERE_TEXELS);
        vec4 sphere = uintBitsToFloat(texelFetch(tree_primitives, texel));
        test_sphere(r, sphere, r.first_primitive + texelFetch(tree_primitives, texel + 1).x, found);
        return;
    }
#endif
    int texel = int(part.first_texel + i * BVH_TRIANGLE_TEXELS);
    uvec4 first = texelFetch(tree_primitives, texel);
    uint primitive = r.first_primitive + first.w;
#ifdef HAS_MOTION
    test_triangle(r, primitive, found);
#else
    vec3 b = uintBitsToFloat(texelFetch(tree_primitives, texel + 1).xyz);
    vec3 c = uintBitsToFloat(texelFetch(tree_primitives, texel + 2).xyz);
    candidate hit = candidate(0.0, primitive, r.instance_index, vec2(0.0));
    if (intersect_triangle(r.object.direction, uintBitsToFloat(first.xyz) - r.object.origin, b - r.object.origin,
                           c - r.object.origin, hit.distance, hit.barycentrics))
        offer(r, hit, found);
#endif
}

// All invocations of a SIMD group first find their leaf, then all test primitives.
void test_pair(uvec4 pair, leaf_ray r, inout pair_answer found)
{
    subtree part = subtree_of(r.instance_index, pair.y, r.object);
    r.first_primitive = part.first_primitive;
    while (part.element < part.end) {
        float end = end_of(r, found);
        uint leaf = 0u;
        while (leaf == 0u && part.element < part.end) {
            leaf = test_element(part, r.world.t_min, end);
            box_tests++;
        }
        uint first = leaf & BVH_LEAF_FIRST_MASK;
        uint count = leaf == 0u ? 0u : (leaf >> BVH_LEAF_COUNT_SHIFT & BVH_LEAF_COUNT_MASK) + 1u;
        for (uint i = 0u; i < count; i++)
            test_in_order(r, part, first + i, leaf >> BVH_LEAF_KIND_SHIFT == BVH_LEAF_SPHERES, found);
        if (is_done(found))
            part.element = part.end;
    }
}

#endif

leaf_ray leaf_ray_of(uvec4 pair, uint ray)
{
    leaf_ray r;
    r.world = trace_ray_of(ray);
    r.ray = ray;
#ifdef RAYSPACE_FLAT
    r.instance_index = instance_of_item(pair.y);
#else
    r.instance_index = pair.z;
#endif
    r.object = object_from_world_ray(r.world, r.instance_index);
    r.first_primitive = 0u;
    return r;
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

void test_leaf_any(uvec4 pair, uint ray)
{
    leaf_ray r = leaf_ray_of(pair, ray);
    if (distance_left(ray, r.world.t_max) < r.world.t_min)
        return;
    pair_answer found = vec3(0.0);
    test_pair(pair, r, found);
    uvec3 steps = uvec3(found);
    deepen(ray, 0u, steps.x);
    deepen(ray, 1u, steps.y);
    deepen(ray, 2u, steps.z);
}

#else

// The nearest hit: its distance, as ordered_bits(), and the rank. None where a nearer one of the ray is known.
uvec2 test_leaf_closest(uvec4 pair, uint ray)
{
    pair_answer found = pair_answer(0xffffffffu, RAYSPACE_NO_RANK, answers[ray].x);
    test_pair(pair, leaf_ray_of(pair, ray), found);
    return uvec2(found.distance, found.rank);
}

#endif
