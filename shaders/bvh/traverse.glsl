// SPDX-License-Identifier: MIT
// Stackless traversal of a two-level bounding volume tree by baked links; layout and octants: shared/bvh_node.h.
// 'Stackless traversal of a sphere BVH', sections 4 (links), 5 (rays together) and 6 (transform elements).
//
// The host (trace/bvh.c) sets, besides the defines of trace.comp:
//   BVH_SPHERES  bounds are spheres, not boxes
//   BVH_PLAIN    the paper's form, for comparison: elements in a storage buffer, one order for all directions
//
// RAYS_TOGETHER rays walk as one: an element is entered when any of them hits its bound, a primitive is fetched
// once and tested against all. The octant is that of the first live ray; the others' answers are right
// whatever the order, only less is pruned.
//
// Three loops in one another: elements until a leaf, leaves until an instance is entered or left, instances. All
// invocations of a SIMD group first find their leaf, then all test primitives (the paper's PROCESSGEOMETRY):
// software GL runs the code of both sides of a branch for the whole group, so leaf code in the inner loop would
// be paid for at each element.
#include "shared/bvh_node.h"
#include "common/candidate.glsl"
#include "bvh/bounds.glsl"

#ifdef BVH_PLAIN
layout(std430, binding = BIND_TRACER_0) readonly buffer bvh_element_block { bvh_element bvh_elements[]; };
#else
layout(binding = UNIT_TRACER_0) uniform usamplerBuffer bvh_elements;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer bvh_links;
#endif
layout(binding = UNIT_TRACER_2) uniform usamplerBuffer bvh_transforms;
layout(binding = UNIT_TRACER_3) uniform usamplerBuffer bvh_primitives;

uniform uint bvh_top_count;   // elements of the top tree; 0: nothing there
uniform uint bvh_step_budget; // elements that a group of rays may visit; more than all there are, so that only
                              // links that lead in a circle could use it up

#define NOT_INSIDE 0xffffffffu

#if defined HAS_CUTOUT || defined HAS_TRANSLUCENT
#define ASK_MATERIALS
#endif

#ifdef ANY_HIT
#define answer vec3 // transmittance
#else
#define answer candidate
#endif

struct walk_state {
    uint first_element; // of the tree that is walked
    uint first_link;
    uint element;       // next one, counted from the tree's first; BVH_END
    uint budget;
};

struct leaf_element {
    uint bits; // 0: none, the tree is done
    uint miss;
};

// What is known of the instance that is walked.
struct entered_instance {
    uint index; // NOT_INSIDE: the top tree is walked
    uint first_texel;
    uint first_primitive;
};

struct element_data {
    uvec4 lower;
    uvec4 upper; // w: leaf
    uint hit, miss;
};

element_data fetch_element(walk_state walk)
{
#ifdef BVH_PLAIN
    bvh_element e = bvh_elements[walk.first_element + walk.element];
    return element_data(floatBitsToUint(vec4(e.lower_x, e.lower_y, e.lower_z, 0.0)),
                        uvec4(floatBitsToUint(vec3(e.upper_x, e.upper_y, e.upper_z)), e.leaf),
                        walk.element + 1u, e.miss);
#else
    int texel = int(walk.first_element + walk.element) * 2;
    uvec2 link = texelFetch(bvh_links, int(walk.first_link + walk.element)).xy;
    return element_data(texelFetch(bvh_elements, texel), texelFetch(bvh_elements, texel + 1), link.x, link.y);
#endif
}

uint octant_of(vec3 direction)
{
    return (direction.x < 0.0 ? 1u : 0u) | (direction.y < 0.0 ? 2u : 0u) | (direction.z < 0.0 ? 4u : 0u);
}

void begin_tree(inout walk_state walk, uint first_element, uint element_count, vec3 direction)
{
    walk.first_element = first_element;
    walk.first_link = first_element * BVH_OCTANTS + octant_of(direction) * element_count;
}

float end_of(trace_ray r, answer found)
{
#ifdef ANY_HIT
    return r.t_max;
#else
    return found.distance;
#endif
}

// The inner loop: on to the next leaf whose bound some ray hits.
leaf_element next_leaf(inout walk_state walk, bound_ray bound_rays[RAYS_TOGETHER], trace_ray r[RAYS_TOGETHER],
                       answer found[RAYS_TOGETHER])
{
    leaf_element leaf = leaf_element(0u, BVH_END);
    while (walk.element != BVH_END && walk.budget != 0u) {
        element_data e = fetch_element(walk);
        walk.budget--;
        bool any_hit = false;
        for (int k = 0; k < RAYS_TOGETHER; k++)
            any_hit = bound_is_hit(bound_rays[k], e.lower, e.upper, r[k].t_min, end_of(r[k], found[k])) || any_hit;
        leaf = leaf_element(e.upper.w, e.miss);
        if (any_hit && leaf.bits != 0u)
            break;
        leaf.bits = 0u;
        walk.element = any_hit ? e.hit : e.miss;
    }
    return leaf;
}

// A candidate against its ray; a ray of which nothing is left is put out.
void offer(inout trace_ray r, candidate c, inout answer found)
{
#ifdef ANY_HIT
    if (offer_any(r, c, found)) {
        found = vec3(0.0);
        r.t_max = -1.0; // no bound and no primitive is hit by it any more
        r.t_min = 0.0;
    }
#else
    offer_closest(r, c, found);
#endif
}

// Where materials have to be asked, what the rays found on a primitive is noted first and settled one by one in a
// loop: the code that asks (textures and all) would else stand in the program once for each ray and root.
struct noted_hits {
    vec2 distances; // triangles have the first alone
    vec2 barycentrics;
};

void offer_or_note(uint bit, candidate c, inout trace_ray r, inout answer found, inout noted_hits noted,
                   inout uint noted_bits)
{
#ifdef ASK_MATERIALS
    if (c.distance > r.t_min && c.distance < end_of(r, found)) {
        noted.distances[bit & 1u] = c.distance;
        noted.barycentrics = c.barycentrics;
        noted_bits |= 1u << bit;
    }
#else
    offer(r, c, found);
#endif
}

#ifdef ASK_MATERIALS
void settle(uint noted_bits, candidate common_part, noted_hits noted[RAYS_TOGETHER],
            inout trace_ray r[RAYS_TOGETHER], inout answer found[RAYS_TOGETHER])
{
    while (noted_bits != 0u) {
        int bit = findLSB(noted_bits), chosen = bit >> 1;
        noted_bits &= noted_bits - 1u;
        trace_ray ray_asking = r[0];
        noted_hits noted_here = noted[0];
        answer found_here = found[0];
        for (int k = 1; k < RAYS_TOGETHER; k++) {
            if (k == chosen) {
                ray_asking = r[k];
                noted_here = noted[k];
                found_here = found[k];
            }
        }
        common_part.distance = (bit & 1) == 0 ? noted_here.distances.x : noted_here.distances.y;
        common_part.barycentrics = noted_here.barycentrics;
        offer(ray_asking, common_part, found_here);
        for (int k = 0; k < RAYS_TOGETHER; k++) {
            if (k == chosen) {
                r[k] = ray_asking;
                found[k] = found_here;
            }
        }
    }
}
#endif

// Primitive i of a leaf against all rays.
void test_primitive(bool is_sphere, uint i, entered_instance inside, object_ray o[RAYS_TOGETHER],
                    inout trace_ray r[RAYS_TOGETHER], inout answer found[RAYS_TOGETHER])
{
    candidate c = candidate(0.0, inside.first_primitive, inside.index, vec2(0.0));
    noted_hits noted[RAYS_TOGETHER];
    uint noted_bits = 0u;
#ifdef HAS_SPHERES
    if (is_sphere) {
        int texel = int(inside.first_texel + i * BVH_SPHERE_TEXELS);
        vec4 sphere = uintBitsToFloat(texelFetch(bvh_primitives, texel));
        c.primitive += texelFetch(bvh_primitives, texel + 1).x;
        for (int k = 0; k < RAYS_TOGETHER; k++) {
            vec2 distances;
            if (intersect_sphere(o[k].origin, o[k].direction, sphere.xyz, sphere.w, distances)) {
                c.distance = distances.x;
                offer_or_note(uint(2 * k), c, r[k], found[k], noted[k], noted_bits);
                c.distance = distances.y;
                offer_or_note(uint(2 * k + 1), c, r[k], found[k], noted[k], noted_bits);
            }
        }
    } else
#endif
    {
        int texel = int(inside.first_texel + i * BVH_TRIANGLE_TEXELS);
        uvec4 first = texelFetch(bvh_primitives, texel);
        vec3 v0 = uintBitsToFloat(first.xyz), v1 = uintBitsToFloat(texelFetch(bvh_primitives, texel + 1).xyz);
        vec3 v2 = uintBitsToFloat(texelFetch(bvh_primitives, texel + 2).xyz);
        c.primitive += first.w;
        for (int k = 0; k < RAYS_TOGETHER; k++)
            if (intersect_triangle(o[k].direction, v0 - o[k].origin, v1 - o[k].origin, v2 - o[k].origin, c.distance,
                                   c.barycentrics))
                offer_or_note(uint(2 * k), c, r[k], found[k], noted[k], noted_bits);
    }
#ifdef ASK_MATERIALS
    settle(noted_bits, c, noted, r, found);
#endif
}

void test_leaf(uint bits, entered_instance inside, object_ray o[RAYS_TOGETHER], inout trace_ray r[RAYS_TOGETHER],
               inout answer found[RAYS_TOGETHER])
{
    uint first = bits & BVH_LEAF_FIRST_MASK;
    uint end = first + (bits >> BVH_LEAF_COUNT_SHIFT & BVH_LEAF_COUNT_MASK) + 1u;
    bool is_sphere = bits >> BVH_LEAF_KIND_SHIFT == BVH_LEAF_SPHERES;
    for (uint i = first; i < end; i++)
        test_primitive(is_sphere, i, inside, o, r, found);
}

bool is_alive_any(trace_ray r[RAYS_TOGETHER])
{
    bool alive = false;
    for (int k = 0; k < RAYS_TOGETHER; k++)
        alive = alive || r[k].t_max > r[k].t_min;
    return alive;
}

// The direction whose octant orders the walk.
vec3 leading_direction(trace_ray r[RAYS_TOGETHER], object_ray o[RAYS_TOGETHER])
{
    vec3 leading = o[0].direction;
    for (int k = RAYS_TOGETHER - 1; k >= 0; k--)
        if (r[k].t_max > r[k].t_min)
            leading = o[k].direction;
    return leading;
}

void trace_together(inout trace_ray r[RAYS_TOGETHER], inout answer found[RAYS_TOGETHER])
{
    if (bvh_top_count == 0u)
        return;
    object_ray o[RAYS_TOGETHER];
    bound_ray bound_rays[RAYS_TOGETHER];
    for (int k = 0; k < RAYS_TOGETHER; k++) {
        o[k] = object_ray(r[k].origin, r[k].direction);
        bound_rays[k] = bound_ray_of(o[k].origin, o[k].direction, WORLD_SLACK);
    }
    walk_state walk;
    walk.element = 0u;
    walk.budget = bvh_step_budget;
    begin_tree(walk, 0u, bvh_top_count, leading_direction(r, o));
    entered_instance inside = entered_instance(NOT_INSIDE, 0u, 0u);
    uint top_links = walk.first_link;  // one order for the whole top tree, also when the leading ray is done
    uint after_instance = BVH_END;     // where the top tree goes on
    for (;;) {
        leaf_element leaf;
        for (;;) {
            leaf = next_leaf(walk, bound_rays, r, found);
            if (leaf.bits == 0u || leaf.bits >> BVH_LEAF_KIND_SHIFT == BVH_LEAF_INSTANCE)
                break;
            test_leaf(leaf.bits, inside, o, r, found);
            walk.element = leaf.miss;
#ifdef ANY_HIT
            if (!is_alive_any(r))
                return;
#endif
        }
        if (leaf.bits != 0u) {
            // A transform element: the ray goes on in the instance's space, wherever the instance lies.
            inside.index = leaf.bits & BVH_LEAF_FIRST_MASK;
            int texel = int(inside.index) * BVH_TRANSFORM_TEXELS;
            vec4 rows[3] = vec4[3](uintBitsToFloat(texelFetch(bvh_transforms, texel)),
                                   uintBitsToFloat(texelFetch(bvh_transforms, texel + 1)),
                                   uintBitsToFloat(texelFetch(bvh_transforms, texel + 2)));
            uvec4 tree = texelFetch(bvh_transforms, texel + 3);
            inside.first_texel = tree.z;
            inside.first_primitive = tree.w;
            for (int k = 0; k < RAYS_TOGETHER; k++)
                o[k] = object_ray(affine_point(rows, r[k].origin), affine_vector(rows, r[k].direction));
            begin_tree(walk, tree.x, tree.y, leading_direction(r, o));
            walk.element = 0u;
            after_instance = leaf.miss;
        } else {
            // The tree is done. Out of an instance the world's ray comes back as it was, not by a second matrix.
            if (inside.index == NOT_INSIDE || after_instance == BVH_END || walk.budget == 0u)
                return;
            inside.index = NOT_INSIDE;
            for (int k = 0; k < RAYS_TOGETHER; k++)
                o[k] = object_ray(r[k].origin, r[k].direction);
            walk.first_element = 0u;
            walk.first_link = top_links;
            walk.element = after_instance;
        }
        float slack = inside.index == NOT_INSIDE ? WORLD_SLACK : OBJECT_SLACK;
        for (int k = 0; k < RAYS_TOGETHER; k++)
            bound_rays[k] = bound_ray_of(o[k].origin, o[k].direction, slack);
    }
}

// What trace.comp calls.
#ifdef ANY_HIT
bool trace_any(trace_ray r, inout vec3 transmittance)
{
    trace_ray rays_walked[RAYS_TOGETHER];
    vec3 found[RAYS_TOGETHER];
    for (int k = 0; k < RAYS_TOGETHER; k++) {
        rays_walked[k] = r;
        found[k] = transmittance;
    }
    trace_together(rays_walked, found);
    transmittance = found[0];
    return greatest(transmittance) == 0.0;
}

void trace_any_together(trace_ray r[RAYS_TOGETHER], inout vec3 transmittance[RAYS_TOGETHER])
{
    trace_together(r, transmittance);
}
#else
void trace_closest(trace_ray r, inout candidate best)
{
    trace_ray rays_walked[RAYS_TOGETHER];
    candidate found[RAYS_TOGETHER];
    for (int k = 0; k < RAYS_TOGETHER; k++) {
        rays_walked[k] = r;
        found[k] = best;
    }
    trace_together(rays_walked, found);
    best = found[0];
}

void trace_closest_together(trace_ray r[RAYS_TOGETHER], inout candidate best[RAYS_TOGETHER])
{
    trace_together(r, best);
}
#endif
