// SPDX-License-Identifier: MIT
// Tests a leaf's primitives against the rays of a packet.
#include "tree/layout.h"
#include "common/candidate.glsl"

layout(binding = UNIT_TRACER_2) uniform usamplerBuffer bvh_primitives;

#if defined HAS_CUTOUT || defined HAS_TRANSLUCENT
#define ASK_MATERIALS
#endif

#ifdef ANY_HIT
#define answer vec3 // optical depth
#else
#define answer candidate
#endif

// State of the traversed instance.
struct entered_instance {
    uint index; // NOT_INSIDE: the top tree is traversed
    uint first_texel;
    uint first_primitive;
#ifdef BVH_DEFORMS_IN_SHUTTER
    uint close_texels; // bvh_transform.close_texels
#endif
};

// Ends a ray: it hits no bound and no primitive any more.
void put_out(inout trace_ray r)
{
    r.t_min = 3e38;
    r.t_max = -1.0;
}

// End of a ray; before its beginning if the ray has ended.
float end_of(trace_ray r, answer found)
{
#ifdef ANY_HIT
    return r.t_max;
#else
    return r.t_max > r.t_min ? found.distance : r.t_max;
#endif
}

#if !defined ANY_HIT && defined ASK_MATERIALS
// Order of surfaces at one distance: lower numbers first, a disc before all, and nothing at the ray's end (disc and miss
// have numbers that wrap to 0).
bool is_before(candidate a, candidate b)
{
    bool has_lower_numbers = a.instance_index == b.instance_index ? a.primitive + 1u < b.primitive + 1u
                                                                  : a.instance_index + 1u < b.instance_index + 1u;
    return a.distance < b.distance || (a.distance == b.distance && has_lower_numbers);
}
#elif !defined ANY_HIT
#define ORDER_HITS
// This order among primitives of the entered instance is the same: those with lower numbers are hit at the distance of what was found.
// Two whole numbers compare faster than four.
int hit_below[PACKET_RAYS];

void order_hits(uint instance_index, candidate found[PACKET_RAYS])
{
    for (int k = 0; k < PACKET_RAYS; k++) {
        uint before = found[k].instance_index + 1u; // 0: a disc, or nothing
        hit_below[k] = before <= instance_index ? 0 : before == instance_index + 1u ? int(found[k].primitive) : 0x7fffffff;
    }
}
#endif

// Offers a candidate to its ray; a shadow ray without transmittance ends.
void offer(inout trace_ray r, candidate c, inout answer found)
{
#ifdef ANY_HIT
    if (offer_any(r, c, found)) {
        found = vec3(OPTICAL_DEPTH_MAX);
        put_out(r);
    }
#elif defined ASK_MATERIALS
    if (c.distance > r.t_min && is_before(c, found) && !is_cut_out(c, r.origin, r.direction, time_of(r)))
        found = c;
#endif
}

// Intersections with a primitive whose materials must be evaluated. They are noted first, and the traversal leaves its
// inner loops to settle them: software GL executes the evaluating code (textures included) at every visit, hit or no hit,
// and in the loop over primitives shadow rays took eight times as long.
struct noted_hits {
    vec2 distances; // triangles have only the first
    vec2 barycentrics;
};

struct noted_primitive {
    uint bits; // two per ray; 0: no hit
    candidate common_part;
    noted_hits hits[PACKET_RAYS];
};

void offer_or_note(uint bit, candidate c, inout trace_ray r, inout answer found, inout noted_hits hits,
                   inout uint bits)
{
#ifdef ASK_MATERIALS
    if (c.distance > r.t_min && c.distance <= end_of(r, found)) {
        hits.distances[bit & 1u] = c.distance;
        hits.barycentrics = c.barycentrics;
        bits |= 1u << bit;
    }
#elif defined ANY_HIT
    offer(r, c, found);
#else
    // Bits of distances beyond t_min, which is not negative, are in their order.
    int k = int(bit >> 1), nearer = floatBitsToInt(c.distance) + (int(c.primitive) < hit_below[k] ? -1 : 0);
    if (c.distance > r.t_min && nearer < floatBitsToInt(found.distance)) {
        found = c;
        hit_below[k] = int(c.primitive);
    }
#endif
}

#ifdef ASK_MATERIALS
void settle(inout noted_primitive noted, inout trace_ray r[PACKET_RAYS], inout answer found[PACKET_RAYS])
{
    while (noted.bits != 0u) {
        int bit = findLSB(noted.bits), chosen = bit >> 1;
        noted.bits &= noted.bits - 1u;
        trace_ray ray_asking = r[0];
        noted_hits noted_here = noted.hits[0];
        answer found_here = found[0];
        for (int k = 1; k < PACKET_RAYS; k++) {
            if (k == chosen) {
                ray_asking = r[k];
                noted_here = noted.hits[k];
                found_here = found[k];
            }
        }
        candidate c = noted.common_part;
        c.distance = (bit & 1) == 0 ? noted_here.distances.x : noted_here.distances.y;
        c.barycentrics = noted_here.barycentrics;
        offer(ray_asking, c, found_here);
        for (int k = 0; k < PACKET_RAYS; k++) {
            if (k == chosen) {
                r[k] = ray_asking;
                found[k] = found_here;
            }
        }
    }
}
#endif

#if PACKET_RAYS > 1 && !defined SHARED_ORIGIN
#define ORIGINS_DIFFER
#endif

// Rays in an instance's space for tests against triangles: relative to the leading ray's origin, so that terms of the
// origin alone are computed once for all. The packet's leading ray leads, finished or not: the rounding of a triangle's
// distance must not depend on earlier hits.
struct relative_rays {
    vec3 centre;
    vec3 direction[PACKET_RAYS];
#ifdef ORIGINS_DIFFER
    vec3 origin[PACKET_RAYS]; // relative to the centre
    vec3 moment[PACKET_RAYS]; // 2 (origin x direction)
#endif
};

relative_rays relative_to(vec3 centre, object_ray o[PACKET_RAYS])
{
    relative_rays rays;
    rays.centre = centre;
    for (int k = 0; k < PACKET_RAYS; k++) {
        rays.direction[k] = o[k].direction;
#ifdef ORIGINS_DIFFER
        rays.origin[k] = o[k].origin - centre;
        rays.moment[k] = 2.0 * cross(rays.origin[k], o[k].direction);
#endif
    }
    return rays;
}

#ifdef BVH_DEFORMS_IN_SHUTTER

// Moves the corners to each ray's own time, so rays share no computation of such a triangle.
void test_triangle(uint i, entered_instance inside, object_ray o[PACKET_RAYS], relative_rays rays,
                   inout trace_ray r[PACKET_RAYS], inout answer found[PACKET_RAYS], inout noted_primitive noted)
{
    int texel = int(inside.first_texel + i * BVH_TRIANGLE_TEXELS), close = texel + int(inside.close_texels);
    uvec4 first = texelFetch(bvh_primitives, texel);
    vec3 v0 = uintBitsToFloat(first.xyz);
    vec3 v1 = uintBitsToFloat(texelFetch(bvh_primitives, texel + 1).xyz);
    vec3 v2 = uintBitsToFloat(texelFetch(bvh_primitives, texel + 2).xyz);
    // Motion is linear: the offset of a triangle that does not move is zero.
    vec3 way0 = uintBitsToFloat(texelFetch(bvh_primitives, close).xyz) - v0;
    vec3 way1 = uintBitsToFloat(texelFetch(bvh_primitives, close + 1).xyz) - v1;
    vec3 way2 = uintBitsToFloat(texelFetch(bvh_primitives, close + 2).xyz) - v2;
    candidate c = candidate(0.0, inside.first_primitive + first.w, inside.index, vec2(0.0));
    for (int k = 0; k < PACKET_RAYS; k++) {
        float time = time_of(r[k]);
        bool is_hit = intersect_triangle(o[k].direction, v0 + time * way0 - o[k].origin,
                                         v1 + time * way1 - o[k].origin, v2 + time * way2 - o[k].origin,
                                         c.distance, c.barycentrics);
        c.distance = is_hit ? c.distance : -1.0;
        offer_or_note(uint(2 * k), c, r[k], found[k], noted.hits[k], noted.bits);
    }
#ifdef ASK_MATERIALS
    noted.common_part = c;
#endif
}

#else

// Tests several rays with the method of intersect_triangle() (common/intersect.glsl). An edge from a to b, e = b - a, s =
// b + a, has for a ray from o along d the edge function d . (e x (s - 2 o)) = d . (e x s) - e . (2 o x d): the first
// cross product is the same for all rays, the second for all edges. Two triangles that share an edge still get exactly
// opposite values.
void test_triangle(uint i, entered_instance inside, object_ray o[PACKET_RAYS], relative_rays rays,
                   inout trace_ray r[PACKET_RAYS], inout answer found[PACKET_RAYS], inout noted_primitive noted)
{
    int texel = int(inside.first_texel + i * BVH_TRIANGLE_TEXELS);
    uvec4 first = texelFetch(bvh_primitives, texel);
    vec3 v0 = uintBitsToFloat(first.xyz) - rays.centre;
    vec3 v1 = uintBitsToFloat(texelFetch(bvh_primitives, texel + 1).xyz) - rays.centre;
    vec3 v2 = uintBitsToFloat(texelFetch(bvh_primitives, texel + 2).xyz) - rays.centre;
    precise vec3 e0 = v2 - v1, e1 = v0 - v2, e2 = v1 - v0;
    precise vec3 c0 = cross(e0, v2 + v1), c1 = cross(e1, v0 + v2), c2 = cross(e2, v1 + v0);
    precise vec3 normal = cross(e2, v2 - v0);
    candidate c = candidate(0.0, inside.first_primitive + first.w, inside.index, vec2(0.0));
    for (int k = 0; k < PACKET_RAYS; k++) {
        vec3 d = rays.direction[k];
#ifdef ORIGINS_DIFFER
        vec3 m = rays.moment[k];
        precise float w0 = dot(c0, d) - dot(e0, m), w1 = dot(c1, d) - dot(e1, m), w2 = dot(c2, d) - dot(e2, m);
        precise float above = dot(normal, v0 - rays.origin[k]);
#else
        precise float w0 = dot(c0, d), w1 = dot(c1, d), w2 = dot(c2, d);
        precise float above = dot(normal, v0);
#endif
        precise float sum = w0 + w1 + w2, slope = dot(normal, d);
        bool inside_edges = (w0 >= 0.0 && w1 >= 0.0 && w2 >= 0.0) || (w0 <= 0.0 && w1 <= 0.0 && w2 <= 0.0);
        c.distance = above / slope;
        // Seen on edge, or without area: no hit.
        c.distance = inside_edges && sum != 0.0 && slope != 0.0 ? c.distance : -1.0;
#ifdef ASK_MATERIALS
        c.barycentrics = vec2(w1, w2) / sum;
#endif
        offer_or_note(uint(2 * k), c, r[k], found[k], noted.hits[k], noted.bits);
    }
#ifdef ASK_MATERIALS
    noted.common_part = c;
#endif
}

#endif

#ifdef HAS_SPHERES
void test_sphere(uint i, entered_instance inside, object_ray o[PACKET_RAYS], inout trace_ray r[PACKET_RAYS],
                 inout answer found[PACKET_RAYS], inout noted_primitive noted)
{
    int texel = int(inside.first_texel + i * BVH_SPHERE_TEXELS);
    vec4 sphere = uintBitsToFloat(texelFetch(bvh_primitives, texel));
    candidate c = candidate(0.0, inside.first_primitive + texelFetch(bvh_primitives, texel + 1).x, inside.index,
                            vec2(0.0));
    for (int k = 0; k < PACKET_RAYS; k++) {
        vec2 distances;
        if (intersect_sphere(o[k].origin, o[k].direction, sphere.xyz, sphere.w, distances)) {
            c.distance = distances.x;
            offer_or_note(uint(2 * k), c, r[k], found[k], noted.hits[k], noted.bits);
            c.distance = distances.y;
            offer_or_note(uint(2 * k + 1), c, r[k], found[k], noted.hits[k], noted.bits);
        }
    }
#ifdef ASK_MATERIALS
    noted.common_part = c;
#endif
}
#endif

// Tests the leaf from `primitive` on, and advances it. False: the leaf is not finished, as an intersection is noted.
bool test_leaf(uint leaf, inout uint primitive, entered_instance inside, object_ray o[PACKET_RAYS], relative_rays rays,
               inout trace_ray r[PACKET_RAYS], inout answer found[PACKET_RAYS], inout noted_primitive noted)
{
    uint first = leaf & BVH_LEAF_FIRST_MASK, count = (leaf >> BVH_LEAF_COUNT_SHIFT & BVH_LEAF_COUNT_MASK) + 1u;
#ifdef HAS_SPHERES
    if (leaf >> BVH_LEAF_KIND_SHIFT == BVH_LEAF_SPHERES) {
        for (; primitive < count && noted.bits == 0u; primitive++)
            test_sphere(first + primitive, inside, o, r, found, noted);
        return primitive == count && noted.bits == 0u;
    }
#endif
    for (; primitive < count && noted.bits == 0u; primitive++)
        test_triangle(first + primitive, inside, o, rays, r, found, noted);
    return primitive == count && noted.bits == 0u;
}
