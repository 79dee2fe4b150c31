// SPDX-License-Identifier: MIT
// Stackless traversal of a two-level bounding volume tree by baked links; layout and octants: tree/layout.h. 'Stackless
// traversal of a sphere BVH', sections 4 (links), 5 (packets) and 6 (transform elements).
//
// The host (trace/bvh/tracer.c) sets, besides the defines of trace/wave.comp:
//   BVH_SPHERES  the paper's form: bounds are spheres, there is one order for all directions, and the rays of a packet
//                stay together, however they diverge
//   BVH_PACKED   boxes are on a grid
//   BVH_WIDE     trees of geometries have wide nodes (wide.glsl), and rays go one by one; the top tree has links
//   BVH_ONE_INSTANCE  there is one instance: no top tree is traversed
//   SHARED_ORIGIN     all rays of the wave begin at one point, also in each instance: terms of the origin alone are
//                     computed once for a packet
//   BVH_DEFORMS_IN_SHUTTER  some meshes deform while the shutter is open
//   BVH_BUDGET        a ray, or a packet, stops at the maximum number of elements per dispatch, and reports it
//   BVH_RESUMES       it resumes in the next dispatch
//
// With HAS_MOTION every ray enters an instance at the ray's own time, and the bounds of leaves include all times.
//
// PACKET_RAYS rays form a packet: an element is entered when any of them may hit its bound, a primitive is fetched
// once and tested against all. The octant is that of the first live ray; the others' answers do not depend on the order,
// but less is pruned.
//
// Answers do not depend on the trees: refitted and rebuilt ones, of elements and of wide nodes, give the same answers, to the
// bit. The intersection with a primitive depends on the ray and the packet's leading ray alone (leaf.glsl); of surfaces at
// one distance the first by instance and primitive is hit (leaf.glsl); optical depths are summed exactly (optical_depth_of).
//
// Three loops are nested: over elements until a leaf, over leaves until an instance is entered or left, over instances.
// All invocations of a SIMD group first find their leaf, then all test primitives (the paper's PROCESSGEOMETRY): software
// GL runs the code of both sides of a branch for the whole group, so each element would pay for leaf code in the inner
// loop.
#include "bvh/layout.h"
#include "bvh/bounds.glsl"
#include "bvh/leaf.glsl"
#include "bvh/packet.glsl"

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer bvh_elements;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer bvh_transforms;

#ifdef BVH_ONE_INSTANCE
uniform uint bvh_instance;
#else
uniform uint bvh_top_count; // elements of the top tree; 0: it is empty
#endif
#ifdef BVH_PACKED
uniform vec3 bvh_top_grid_lower;
uniform vec3 bvh_top_cells_per_unit;
#endif

// Shadow rays that are traversed one by one share few octants: all of them read the first octant's copy, whose order is
// as good for finding any hit, and which stays in the cache. Measured on software GL with 146K triangles: ambient
// occlusion takes 0.9 of the time. (Closest hits take 1.5 of it without their order.)
#if defined ANY_HIT && PACKET_RAYS == 1 && !defined BVH_SPHERES
#define ONE_ORDER
#endif

#define NOT_INSIDE 0xffffffffu

#ifdef BVH_BUDGET
// Limit of elements per dispatch: a driver ends a dispatch that takes seconds, and a ray may meet every element of a
// scene.
uniform uint bvh_budget_max; // elements of a ray, or of a packet
uniform uint unfinished_word; // set to BVH_UNFINISHED where a ray is not finished
layout(std430, binding = BIND_BVH_UNFINISHED) buffer unfinished_block { uint unfinished[]; };
uint budget_left = min(bvh_budget_max, BVH_DISPATCH_ELEMENTS_MAX / max(ray_end - first_ray, 1u));
uvec4 place_of_ray; // bvh/layout.h
#ifdef BVH_RESUMES
#define RAYS_GO_ON
#ifdef BVH_WIDE
#define PLACE_TEXELS BVH_WIDE_PLACE_TEXELS
#else
#define PLACE_TEXELS 1u
#endif
uniform uint resumes;
layout(std430, binding = BIND_BVH_PLACES) buffer place_block { uvec4 places[]; };
#endif
#endif
#define NO_GRID tree_grid(vec3(0.0), vec3(1.0))

struct tree_traversal {
    uint first;   // the traversed tree's copy for the octant
    uint end;     // its number of elements
    uint element; // next one, counted from the first
    uint leaf;    // the current one, 0: none
    uint primitive; // the next one in it
};

void begin_tree(inout tree_traversal traversal, uint first_element, uint element_count, uint octant)
{
#ifdef BVH_SPHERES
    traversal.first = first_element;
#elif defined ONE_ORDER
    traversal.first = first_element * BVH_OCTANTS;
#else
    traversal.first = first_element * BVH_OCTANTS + octant * element_count;
#endif
    traversal.end = element_count;
    traversal.element = 0u;
    traversal.leaf = traversal.primitive = 0u;
}

// Range of distances in which some ray may still hit something.
struct distances_left {
    float t_min, t_max;
};

distances_left left_of(trace_ray r[PACKET_RAYS], answer found[PACKET_RAYS])
{
    distances_left left = distances_left(r[0].t_min, end_of(r[0], found[0]));
    for (int k = 1; k < PACKET_RAYS; k++) {
        left.t_min = min(left.t_min, r[k].t_min);
        left.t_max = max(left.t_max, end_of(r[k], found[k]));
    }
#ifndef ANY_HIT
    left.t_max *= PRUNE_SLACK;
#endif
    return left;
}

// Tests an element, and advances to the next one. Returns its link if it is a leaf that some ray may hit, else 0.
uint test_element(inout tree_traversal traversal, bundle b, distances_left left, trace_ray r[PACKET_RAYS],
                  answer found[PACKET_RAYS])
{
#ifndef BVH_PACKED
    int texel = int(traversal.first + traversal.element) * 2;
    uvec4 first_half = texelFetch(bvh_elements, texel);
    vec3 lower_corner = uintBitsToFloat(first_half.xyz);
    vec3 upper_corner = uintBitsToFloat(texelFetch(bvh_elements, texel + 1).xyz);
    vec4 lower = vec4(lower_corner, upper_corner.x);
    uint link = first_half.w;
#else
    uvec4 element = texelFetch(bvh_elements, int(traversal.first + traversal.element));
    uint link = element.w;
#endif
#ifdef BVH_SPHERES
    bool any_hit = false;
    for (int k = 0; k < PACKET_RAYS; k++)
        any_hit = sphere_is_hit(b.rays[k], lower, r[k].t_min, end_of(r[k], found[k])) || any_hit;
#elif defined BVH_PACKED
#ifdef ONE_ORDER
    uvec3 first_corner = uvec3(b.octant << 4, b.octant << 3, b.octant << 2) & 16u; // 16: the other corner
#else
    const uvec3 first_corner = uvec3(0u);
#endif
    bool any_hit = box_is_hit(b, vec3(ivec3(element.xyz >> first_corner & 0xffffu)),
                              vec3(ivec3(element.xyz >> (16u - first_corner) & 0xffffu)), left.t_min, left.t_max);
#else
    bvec3 negative = notEqual(uvec3(b.octant) & uvec3(1u, 2u, 4u), uvec3(0u));
    bool any_hit = box_is_hit(b, mix(lower_corner, upper_corner, negative),
                              mix(upper_corner, lower_corner, negative), left.t_min, left.t_max);
#endif
    bool is_leaf = link >> BVH_LEAF_KIND_SHIFT != 0u;
    uint after_miss = link;
#ifdef BVH_BUDGET
    // A link never leads backwards, so no structure can keep a ray longer than it has elements. Software GL leaves a loop
    // after 65535 rounds.
    after_miss = max(link, traversal.element + 1u);
#endif
    traversal.element = any_hit || is_leaf ? traversal.element + 1u : after_miss;
    return any_hit && is_leaf ? link : 0u;
}

bool is_searching(tree_traversal traversal)
{
    return traversal.leaf == 0u && traversal.element < traversal.end;
}

// The inner loop: advances to the next leaf whose bound some ray may hit. Returns its link; 0: the tree is finished.
uint next_leaf(inout tree_traversal traversal, bundle b, distances_left left, trace_ray r[PACKET_RAYS],
               answer found[PACKET_RAYS])
{
    tree_traversal next = traversal;
    while (is_searching(next)) {
#ifdef BVH_BUDGET
        if (budget_left == 0u)
            break;
        budget_left--;
#endif
        next.leaf = test_element(next, b, left, r, found);
    }
    traversal.element = next.element;
    return next.leaf;
}

bool is_alive_any(trace_ray r[PACKET_RAYS])
{
    bool alive = false;
    for (int k = 0; k < PACKET_RAYS; k++)
        alive = alive || r[k].t_max > r[k].t_min;
    return alive;
}

// Enters a tree with all live rays: computes their bounds in its space.
void enter_tree(object_ray o[PACKET_RAYS], trace_ray r[PACKET_RAYS], int leading, tree_grid grid, float slack,
                out bundle b, out relative_rays rays)
{
    uint alive = 0u; // a bit for each ray: Mesa 22.3's zink fails with an array of bool
    vec3 centre = o[0].origin;
    for (int k = 0; k < PACKET_RAYS; k++) {
        alive |= r[k].t_max > r[k].t_min ? 1u << k : 0u;
        centre = k == leading ? o[k].origin : centre;
    }
    b = bundle_of(o, alive, leading, grid, slack);
    rays = relative_to(centre, o);
}

// Link that no leaf has: an intersection is noted, and the current leaf is not finished.
#define LEAF_NOTED 1u

#include "bvh/wide.glsl"

// A transform element: the rays continue in the instance's space.
void enter_instance(uint instance_index, trace_ray r[PACKET_RAYS], int leading, out entered_instance inside,
                    out object_ray o[PACKET_RAYS], out tree_traversal traversal, out bundle b, out relative_rays rays)
{
    int texel = int(instance_index) * BVH_TRANSFORM_TEXELS;
#ifndef HAS_MOTION
    vec4 rows[3] = vec4[3](uintBitsToFloat(texelFetch(bvh_transforms, texel)),
                           uintBitsToFloat(texelFetch(bvh_transforms, texel + 1)),
                           uintBitsToFloat(texelFetch(bvh_transforms, texel + 2)));
#endif
    uvec4 tree = texelFetch(bvh_transforms, texel + 5);
    inside.index = instance_index;
    inside.first_texel = tree.z;
    inside.first_primitive = tree.w;
#ifdef BVH_DEFORMS_IN_SHUTTER
    inside.close_texels = texelFetch(bvh_transforms, texel + 3).w;
#endif
#if defined SHARED_ORIGIN && !defined HAS_MOTION
    vec3 origin = affine_point(rows, r[0].origin);
#endif
    for (int k = 0; k < PACKET_RAYS; k++) {
#ifdef HAS_MOTION
        o[k] = object_from_world_ray(r[k], instance_index);
#elif defined SHARED_ORIGIN
        o[k] = object_ray(origin, affine_vector(rows, r[k].direction));
#else
        o[k] = object_ray(affine_point(rows, r[k].origin), affine_vector(rows, r[k].direction));
#endif
    }
#ifdef BVH_WIDE
    rays = relative_to(o[0].origin, o);
    begin_wide(o[0], uintBitsToFloat(texelFetch(bvh_transforms, texel + 3).xyz), tree.x, tree.y);
    traversal = tree_traversal(0u, 0u, 0u, 0u, 0u); // no elements
#else
    tree_grid grid = NO_GRID;
#ifdef BVH_PACKED
    grid = tree_grid(uintBitsToFloat(texelFetch(bvh_transforms, texel + 3)).xyz,
                     uintBitsToFloat(texelFetch(bvh_transforms, texel + 4)).xyz);
#endif
    enter_tree(o, r, leading, grid, OBJECT_SLACK, b, rays);
    begin_tree(traversal, tree.x, tree.y, b.octant);
#endif
}

// Traverses the leaves of the current tree. Returns the link of the next instance; 0: the tree is finished; or
// LEAF_NOTED, where an intersection must be settled.
uint test_leaves(inout tree_traversal traversal, bundle b, entered_instance inside, object_ray o[PACKET_RAYS],
                 relative_rays rays, inout trace_ray r[PACKET_RAYS], inout answer found[PACKET_RAYS],
                 inout noted_primitive noted)
{
#ifdef BVH_WIDE
#ifndef BVH_ONE_INSTANCE
    if (inside.index == NOT_INSIDE)
        return next_leaf(traversal, b, left_of(r, found), r, found);
#endif
    return test_wide_leaves(inside, o, rays, r, found, noted);
#else
    for (;;) {
        uint leaf = next_leaf(traversal, b, left_of(r, found), r, found);
        if (leaf == 0u || leaf >> BVH_LEAF_KIND_SHIFT == BVH_LEAF_INSTANCE)
            return leaf;
#ifdef ASK_MATERIALS
        traversal.leaf = test_leaf(leaf, traversal.primitive, inside, o, rays, r, found, noted) ? 0u : leaf;
        if (traversal.leaf != 0u)
            return LEAF_NOTED;
        traversal.primitive = 0u;
#else
        uint primitive = 0u;
        test_leaf(leaf, primitive, inside, o, rays, r, found, noted);
#ifdef ANY_HIT
        if (!is_alive_any(r))
            traversal.element = traversal.end;
#endif
#endif
    }
#endif
}

#ifdef ASK_MATERIALS
void settle_and_continue(inout tree_traversal traversal, inout noted_primitive noted, inout trace_ray r[PACKET_RAYS],
                      inout answer found[PACKET_RAYS])
{
    settle(noted, r, found);
#ifdef ANY_HIT
    if (!is_alive_any(r)) {
        traversal.leaf = 0u;
        traversal.element = traversal.end;
#ifdef BVH_WIDE
        end_wide();
#endif
    }
#endif
}
#endif

bool is_finished(tree_traversal traversal)
{
#ifdef BVH_WIDE
    if (wide.nodes.y != 0u)
        return false;
#endif
    return traversal.element >= traversal.end;
}

// The first tree of a packet: the top tree, or that of the one instance.
void begin_packet(trace_ray r[PACKET_RAYS], int leading, out entered_instance inside, out object_ray o[PACKET_RAYS],
                  out tree_traversal traversal, out tree_traversal world_traversal, out bundle b,
                  out bundle world_bundle, out relative_rays rays)
{
#ifdef BVH_ONE_INSTANCE
    enter_instance(bvh_instance, r, leading, inside, o, traversal, b, rays);
    world_traversal = traversal;
    world_bundle = b;
#else
    tree_grid grid = NO_GRID;
#ifdef BVH_PACKED
    grid = tree_grid(bvh_top_grid_lower, bvh_top_cells_per_unit);
#endif
    for (int k = 0; k < PACKET_RAYS; k++)
        o[k] = object_ray(r[k].origin, r[k].direction);
    enter_tree(o, r, leading, grid, WORLD_SLACK, world_bundle, rays);
    begin_tree(world_traversal, 0u, bvh_top_count, world_bundle.octant);
    inside.index = NOT_INSIDE;
    inside.first_texel = inside.first_primitive = 0u;
#ifdef BVH_DEFORMS_IN_SHUTTER
    inside.close_texels = 0u;
#endif
    b = world_bundle;
    traversal = world_traversal;
#ifdef BVH_WIDE
    end_wide();
#endif
#endif
}

#ifdef BVH_ONE_INSTANCE

bool cross_border(uint leaf, inout tree_traversal traversal, inout tree_traversal world_traversal, inout bundle b,
                  bundle world_bundle, int leading, inout entered_instance inside, inout object_ray o[PACKET_RAYS],
                  inout relative_rays rays, inout trace_ray r[PACKET_RAYS], inout answer found[PACKET_RAYS])
{
    return false;
}

#else

// Enters the instance of that leaf; or leaves the current instance if `leaf` is 0, as its tree is finished. False:
// nothing is left to traverse.
bool cross_border(uint leaf, inout tree_traversal traversal, inout tree_traversal world_traversal, inout bundle b,
                  bundle world_bundle, int leading, inout entered_instance inside, inout object_ray o[PACKET_RAYS],
                  inout relative_rays rays, inout trace_ray r[PACKET_RAYS], inout answer found[PACKET_RAYS])
{
    if (leaf != 0u) {
        world_traversal.element = traversal.element;
        enter_instance(leaf & BVH_LEAF_FIRST_MASK, r, leading, inside, o, traversal, b, rays);
#ifdef ORDER_HITS
        order_hits(inside.index, found);
#endif
        return true;
    }
#ifdef BVH_BUDGET
    if (!is_finished(traversal))
        return false;
#endif
    bool all_done = inside.index == NOT_INSIDE;
#ifdef ANY_HIT
    all_done = all_done || !is_alive_any(r);
#endif
    if (all_done)
        return false;
    inside.index = NOT_INSIDE;
    b = world_bundle;
    traversal = world_traversal;
    return true;
}

#endif

// Traverses the instances along the rays. True: an intersection must be settled before the traversal continues.
bool traverse_instances(inout tree_traversal traversal, inout tree_traversal world_traversal, inout bundle b,
                        bundle world_bundle, int leading, inout entered_instance inside, inout object_ray o[PACKET_RAYS],
                        inout relative_rays rays, inout trace_ray r[PACKET_RAYS], inout answer found[PACKET_RAYS],
                        inout noted_primitive noted)
{
    for (;;) {
        uint leaf = test_leaves(traversal, b, inside, o, rays, r, found, noted);
#ifdef ASK_MATERIALS
        if (leaf == LEAF_NOTED)
            return true;
#endif
        if (!cross_border(leaf, traversal, world_traversal, b, world_bundle, leading, inside, o, rays, r, found))
            return false;
    }
}

// Traces a packet. `leading`: the first ray that was active as the packet began; it keeps the lead, also when it is
// finished.
void trace_packet(inout trace_ray r[PACKET_RAYS], int leading, inout answer found[PACKET_RAYS])
{
    entered_instance inside;
    object_ray o[PACKET_RAYS];
    tree_traversal traversal, world_traversal;
    bundle b, world_bundle;
    relative_rays rays;
    begin_packet(r, leading, inside, o, traversal, world_traversal, b, world_bundle, rays);
#if defined ORDER_HITS && defined BVH_ONE_INSTANCE
    order_hits(inside.index, found);
#endif
#ifdef BVH_BUDGET
#ifndef BVH_ONE_INSTANCE
    if (place_of_ray.y != NOT_INSIDE) {
        world_traversal.element = place_of_ray.z;
        enter_instance(place_of_ray.y, r, leading, inside, o, traversal, b, rays);
#ifdef ORDER_HITS
        order_hits(place_of_ray.y, found);
#endif
    }
#endif
    traversal.element = place_of_ray.x;
#if defined BVH_WIDE && defined BVH_RESUMES
    if (resumes != 0u)
        load_wide();
#endif
#endif
    noted_primitive noted;
    noted.bits = 0u;
#ifdef ASK_MATERIALS
    while (traverse_instances(traversal, world_traversal, b, world_bundle, leading, inside, o, rays, r, found, noted))
        settle_and_continue(traversal, noted, r, found);
#else
    traverse_instances(traversal, world_traversal, b, world_bundle, leading, inside, o, rays, r, found, noted);
#endif
#ifdef BVH_BUDGET
#ifdef BVH_ONE_INSTANCE
    place_of_ray = uvec4(traversal.element, NOT_INSIDE, 0u, is_finished(traversal));
#else
    place_of_ray = uvec4(traversal.element, inside.index, world_traversal.element, is_finished(traversal));
#endif
#endif
}

// Begins the invocation's budget of elements. False: it has nothing left to do.
bool begin_budget()
{
#ifdef BVH_BUDGET
    place_of_ray = uvec4(0u, NOT_INSIDE, 0u, 0u);
#ifdef BVH_RESUMES
    if (resumes != 0u)
        place_of_ray = places[item_index() * PLACE_TEXELS];
#endif
    return (place_of_ray.w & 1u) == 0u;
#else
    return true;
#endif
}

void end_budget()
{
#ifdef BVH_BUDGET
#ifdef BVH_RESUMES
    places[item_index() * PLACE_TEXELS] = place_of_ray;
#ifdef BVH_WIDE
    if ((place_of_ray.w & 1u) == 0u)
        store_wide();
#endif
#endif
    if ((place_of_ray.w & 1u) == 0u && unfinished[unfinished_word] == 0u)
        atomicCompSwap(unfinished[unfinished_word], 0u, BVH_UNFINISHED);
#endif
}

// trace/wave.comp calls this for each ray.
#if PACKET_RAYS == 1

#ifdef ANY_HIT
bool trace_any(trace_ray r, inout vec3 optical_depth)
{
    trace_ray packet[PACKET_RAYS] = trace_ray[PACKET_RAYS](r);
    vec3 found[PACKET_RAYS] = vec3[PACKET_RAYS](optical_depth);
    if (begin_budget())
        trace_packet(packet, 0, found);
    end_budget();
    optical_depth = found[0];
    return min_component(optical_depth) >= OPTICAL_DEPTH_BLACK;
}
#else
void trace_closest(trace_ray r, inout candidate best)
{
    trace_ray packet[PACKET_RAYS] = trace_ray[PACKET_RAYS](r);
    candidate found[PACKET_RAYS] = candidate[PACKET_RAYS](best);
    if (begin_budget())
        trace_packet(packet, 0, found);
    end_budget();
    best = found[0];
}
#endif

#else

#ifdef ANY_HIT
#define TRACE_GROUP trace_any_rays
#else
#define TRACE_GROUP trace_closest_rays
#endif

// Divides the rays into packets: each packet has all remaining rays with a direction similar to the first one's, and the
// first one in any case, NaN included. In the paper's form a single packet has all rays.
void TRACE_GROUP(trace_ray r[PACKET_RAYS], inout answer found[PACKET_RAYS])
{
    uint waiting = 0u;
    for (int k = 0; k < PACKET_RAYS; k++)
        waiting |= r[k].t_max > r[k].t_min ? 1u << k : 0u;
    if (!begin_budget())
        waiting = 0u;
#ifdef BVH_RESUMES
    else if (resumes != 0u)
        waiting = place_of_ray.w >> 1; // forms the same packet again; some of its rays may be finished by now
#endif
    while (waiting != 0u) {
        uint before = waiting;
        int first = findLSB(waiting);
        trace_ray leading = r[0], packet[PACKET_RAYS];
        for (int k = 1; k < PACKET_RAYS; k++)
            if (k == first)
                leading = r[k];
        for (int k = 0; k < PACKET_RAYS; k++) {
            packet[k] = r[k];
#ifdef SHARED_ORIGIN
            packet[k].origin = leading.origin; // dead rays get an origin
#endif
#ifdef BVH_SPHERES
            const bool goes = true;
#else
            bool goes = k == first ||
                        form_packet(leading.origin, leading.direction, r[k].origin, r[k].direction);
#endif
            if (goes && (waiting >> k & 1u) != 0u)
                waiting &= ~(1u << k);
            else
                put_out(packet[k]);
        }
        trace_packet(packet, first, found);
#ifdef BVH_BUDGET
        if (place_of_ray.w == 0u) {
            waiting = before;
            break;
        }
        place_of_ray = uvec4(0u, NOT_INSIDE, 0u, 0u);
#endif
    }
#ifdef BVH_BUDGET
    place_of_ray.w = waiting << 1 | (waiting == 0u ? 1u : 0u);
#endif
    end_budget();
}

#endif
