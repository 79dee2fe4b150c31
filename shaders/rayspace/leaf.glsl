// SPDX-License-Identifier: MIT
// Tests of a ray against the primitives of a pair.
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

#if defined HAS_CUTOUT || defined HAS_TRANSLUCENT
#define ASK_MATERIALS
#endif

// Ray of a pair in the pair's instance.
struct leaf_ray {
    trace_ray world;
    object_ray object;
    uint instance_index, first_primitive;
    uint first_rank; // rank of the instance's first primitive
};

// Intersections whose materials must be evaluated. Software GL executes the evaluating code for all rays of a SIMD group,
// hit or no hit: it stands outside of the loops over elements and primitives.
struct noted_hits {
    uint count;
    candidate first;
    float second; // distance of a sphere's far side
};

uint triangle_tests = 0u, box_tests = 0u;

#ifdef ANY_HIT

// Optical depth found for the pair.
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

bool is_of_interest(leaf_ray r, float distance_, pair_answer found)
{
    return distance_ > r.world.t_min && distance_ < r.world.t_max;
}

#else

struct pair_answer {
    float distance; // distance of the pair's nearest hit
    uint rank;      // RAYSPACE_NO_RANK: none
    float known;    // distance of the ray's nearest hit so far; that of its end
};

bool is_done(pair_answer found)
{
    return false;
}

// Distance up to which the ray needs to be traced: hits at the same distance count too, as ranks decide among them.
float end_of(leaf_ray r, pair_answer found)
{
    return found.known + abs(found.known) * (PRUNE_SLACK - 1.0);
}

bool is_of_interest(leaf_ray r, float distance_, pair_answer found)
{
    return distance_ > r.world.t_min && distance_ < r.world.t_max && distance_ <= found.known;
}

void offer(leaf_ray r, candidate hit, inout pair_answer found)
{
    uint rank = r.first_rank + hit.primitive - r.first_primitive;
    bool is_nearer = found.rank == RAYSPACE_NO_RANK || hit.distance < found.distance ||
                     (hit.distance == found.distance && rank < found.rank);
    if (!is_of_interest(r, hit.distance, found) || !is_nearer)
        return;
#ifdef ASK_MATERIALS
    if (is_cut_out(hit, r.world.origin, r.world.direction, time_of(r.world)))
        return;
#endif
    found = pair_answer(hit.distance, rank, hit.distance);
}

#endif

void offer_or_note(leaf_ray r, candidate hit, inout pair_answer found, inout noted_hits noted)
{
#ifdef ASK_MATERIALS
    if (!is_of_interest(r, hit.distance, found))
        return;
    if (noted.count == 0u)
        noted.first = hit;
    else
        noted.second = hit.distance;
    noted.count++;
#else
    offer(r, hit, found);
#endif
}

// Settles the first of the noted hits; the second one becomes the first.
void settle_one(leaf_ray r, inout pair_answer found, inout noted_hits noted)
{
    offer(r, noted.first, found);
    noted.first.distance = noted.second;
    noted.count--;
}

#ifdef HAS_SPHERES
void test_sphere(leaf_ray r, vec4 sphere, uint primitive, inout pair_answer found, inout noted_hits noted)
{
    vec2 distances;
    if (!intersect_sphere(r.object.origin, r.object.direction, sphere.xyz, sphere.w, distances))
        return;
    offer_or_note(r, candidate(distances.x, primitive, r.instance_index, vec2(0.0)), found, noted);
    offer_or_note(r, candidate(distances.y, primitive, r.instance_index, vec2(0.0)), found, noted);
}
#endif

void test_triangle(leaf_ray r, uint primitive, inout pair_answer found, inout noted_hits noted)
{
    candidate hit;
    if (intersect_primitive(r.world, r.object, primitive, r.instance_index, hit))
        offer_or_note(r, hit, found, noted);
}

#ifdef RAYSPACE_FLAT

void test_pair(uvec4 pair, leaf_ray r, inout pair_answer found)
{
    geometry g = geometry_at(instance_at(r.instance_index).geometry);
    r.first_primitive = g.first_primitive;
    uint primitive = r.first_primitive + number_of_item(pair.y);
    noted_hits noted;
    noted.count = 0u;
    triangle_tests++;
#ifdef HAS_SPHERES
    if (g.kind == GEOMETRY_SPHERES)
        test_sphere(r, texelFetch(spheres, int(primitive)), primitive, found, noted);
    else
#endif
        test_triangle(r, primitive, found, noted);
    while (noted.count > 0u)
        settle_one(r, found, noted);
}

#else

// Tests primitive i in the order of the tree, which has a copy of its corners. The copy is from shutter open, so a shape
// that moves uses the geometry's own.
void test_in_order(leaf_ray r, subtree part, uint i, bool is_sphere, inout pair_answer found, inout noted_hits noted)
{
    triangle_tests++;
#ifdef HAS_SPHERES
    if (is_sphere) {
        int texel = int(part.first_texel + i * BVH_SPHERE_TEXELS);
        vec4 sphere = uintBitsToFloat(texelFetch(tree_primitives, texel));
        test_sphere(r, sphere, r.first_primitive + texelFetch(tree_primitives, texel + 1).x, found, noted);
        return;
    }
#endif
    int texel = int(part.first_texel + i * BVH_TRIANGLE_TEXELS);
    uvec4 first = texelFetch(tree_primitives, texel);
    uint primitive = r.first_primitive + first.w;
#ifdef HAS_MOTION
    test_triangle(r, primitive, found, noted);
#else
    vec3 b = uintBitsToFloat(texelFetch(tree_primitives, texel + 1).xyz);
    vec3 c = uintBitsToFloat(texelFetch(tree_primitives, texel + 2).xyz);
    candidate hit = candidate(0.0, primitive, r.instance_index, vec2(0.0));
    if (intersect_triangle(r.object.direction, uintBitsToFloat(first.xyz) - r.object.origin, b - r.object.origin,
                           c - r.object.origin, hit.distance, hit.barycentrics))
        offer_or_note(r, hit, found, noted);
#endif
}

// Tests a pair. The invocations of a SIMD group first find their leaves, then test primitives, and then evaluate
// materials, all at the same time.
void test_pair(uvec4 pair, leaf_ray r, inout pair_answer found)
{
    subtree part = subtree_of(r.instance_index, pair.y, r.object);
    r.first_primitive = part.first_primitive;
    noted_hits noted;
    noted.count = 0u;
    uint leaf = 0u, next = 0u, end = 0u; // primitives of the leaf
    for (;;) {
        while (noted.count == 0u && (next < end || part.element < part.end)) {
            float ray_end = end_of(r, found);
            while (next == end && part.element < part.end) {
                leaf = test_element(part, r.world.t_min, ray_end);
                if (leaf != 0u) {
                    next = leaf & BVH_LEAF_FIRST_MASK;
                    end = next + (leaf >> BVH_LEAF_COUNT_SHIFT & BVH_LEAF_COUNT_MASK) + 1u;
                }
                box_tests++;
            }
            for (; next < end && noted.count == 0u; next++)
                test_in_order(r, part, next, leaf >> BVH_LEAF_KIND_SHIFT == BVH_LEAF_SPHERES, found, noted);
#ifndef ASK_MATERIALS
            if (is_done(found))
                part.element = part.end;
#endif
        }
        if (noted.count == 0u)
            break;
        settle_one(r, found, noted);
        if (is_done(found))
            break;
    }
}

#endif

leaf_ray leaf_ray_of(uvec4 pair, uint ray)
{
    leaf_ray r;
    r.world = trace_ray_of(ray);
#ifdef RAYSPACE_FLAT
    r.instance_index = instance_of_item(pair.y);
#else
    r.instance_index = pair.z;
#endif
    r.object = object_from_world_ray(r.world, r.instance_index);
    r.first_primitive = 0u;
#ifndef ANY_HIT
    r.first_rank = first_rank_of(r.instance_index);
#endif
    return r;
}

#ifdef ANY_HIT

// Adds to the optical depths of a ray, up to the maximum, so that they cannot overflow.
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
#ifdef HAS_TRANSLUCENT
    uvec3 steps = uvec3(found);
    deepen(ray, 0u, steps.x);
    deepen(ray, 1u, steps.y);
    deepen(ray, 2u, steps.z);
#else
    if (found.x > 0.0)
        answers[ray].xyz = uvec3(OPTICAL_DEPTH_MAX);
#endif
}

#else

// Nearest hit: its distance, as ordered_bits(), and the rank. None where a nearer one of the ray is known.
uvec2 test_leaf_closest(uvec4 pair, uint ray)
{
    leaf_ray r = leaf_ray_of(pair, ray);
    pair_answer found = pair_answer(0.0, RAYSPACE_NO_RANK, distance_left(ray, r.world.t_max));
    test_pair(pair, r, found);
    uint distance_ = ordered_bits(found.distance);
    if (found.rank != RAYSPACE_NO_RANK)
        atomicMin(answers[ray].x, distance_);
    return uvec2(distance_, found.rank);
}

#endif
