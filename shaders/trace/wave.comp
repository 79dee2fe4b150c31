// SPDX-License-Identifier: MIT
// Traces a wave of rays through an acceleration structure: the entry point of every <tracer>/traverse.glsl.
//
// The host (trace/program.c) sets the defines:
//   TRAVERSE             "bvh/traverse.glsl", the structure's traversal
//   and others of the tracer's own choice
//   ANY_HIT              the wave asks for transmittance, not for the closest surface
//   HAS_SPHERES          some geometry is made of spheres
//   HAS_DISCS            there are discs
//   HAS_MOTION           something moves while the shutter is open, and rays have times
//   HAS_CUTOUT           some material is alpha mode mask
//   HAS_TRANSLUCENT      some material lets shadow rays pass
//   HAS_TRANSMISSION     some of these tint them
//   EVEN_ALPHA           none of these has a texture or vertex colours
//   HAS_COUNTS           only the device knows how many rays there are
//   PACKET_RAYS        how many consecutive rays one invocation traverses as a packet: 1, 2, 3, 4, 8
//
// A traverse.glsl defines one of these, for ANY_HIT or not, and for PACKET_RAYS 1 or more:
//   void trace_closest(trace_ray r, inout candidate best);
//   bool trace_any(trace_ray r, inout vec3 optical_depth);
//   void trace_closest_rays(trace_ray r[PACKET_RAYS], inout candidate best[PACKET_RAYS]);
//   void trace_any_rays(trace_ray r[PACKET_RAYS], inout vec3 optical_depth[PACKET_RAYS]);
// It does not include this file; it includes common/candidate.glsl, whose visit_* and offer_* functions take a
// primitive against a ray with cutouts and tints accounted for. A traversal with an intersection test of its own calls
// offer_closest / offer_any with the candidate, or, where the scene has neither cutouts nor translucent surfaces (no
// define), may compare distances itself. `best.distance` starts at the ray's end, or at the nearest disc. offer_any adds
// to `optical_depth`; trace_any returns true, and may stop, once offer_any did: no light is left.
//
// A traverse.glsl may define RAYS_GO_ON: several dispatches trace the same rays, which keep their findings; the first one
// has is_first_part 1. BIND_OPTICAL_DEPTHS is then a buffer with a vec4 for each ray of the dispatch.
//
// This file handles everything else: discs, dead rays (t_max <= t_min), rays beyond the wave's end, and the answer: a
// visibility, or an intersection (shared/hit.h) that surface.comp turns into a hit. Some of several rays may be dead:
// they have t_max = -1 and t_min = 0, direction (1 0 0) and can hit nothing, so a traversal must not rely on ray 0 for
// the others. Groups of dead rays alone do not reach it.
#include "shared/bindings.h"
#include "shared/ray.h"
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "common/candidate.glsl"
#include "common/discs.glsl"
#include "common/visibility.glsl"

#ifndef PACKET_RAYS
#define PACKET_RAYS 1
#endif
#include TRAVERSE

// Second word of an intersection (shared/hit.h); a traverse.glsl may define it.
#ifndef INTERSECTION_FLAGS
#define INTERSECTION_FLAGS 0u
#endif

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // two texels per ray: software GL fetches these faster
#ifdef HAS_MOTION
layout(binding = UNIT_RAY_TIMES) uniform samplerBuffer ray_times;
#endif
#ifdef ANY_HIT
layout(std430, binding = BIND_VISIBILITY) writeonly buffer visibility_block { uint visibilities[]; };
#else
#ifdef RAYS_GO_ON
layout(binding = IMAGE_HITS, rgba32ui) uniform uimageBuffer intersections;
#else
layout(binding = IMAGE_HITS, rgba32ui) writeonly uniform uimageBuffer intersections;
#endif
#endif

#ifdef RAYS_GO_ON
uniform uint is_first_part;
#ifdef ANY_HIT
// Exact, as visibilities are rounded.
layout(std430, binding = BIND_OPTICAL_DEPTHS) buffer depth_block { vec4 optical_depths[]; };
#endif
#endif

bool is_alive(trace_ray r)
{
    return r.t_max > r.t_min;
}

trace_ray load_ray(uint ray_index)
{
#ifdef HAS_MOTION
    float time = ray_index < ray_end ? texelFetch(ray_times, int(ray_index)).x : 0.0;
    trace_ray dead = trace_ray(vec3(0.0), vec3(1.0, 0.0, 0.0), 0.0, -1.0, time);
#else
    trace_ray dead = trace_ray(vec3(0.0), vec3(1.0, 0.0, 0.0), 0.0, -1.0);
#endif
    if (ray_index >= ray_end)
        return dead;
    vec4 origin_t_min = texelFetch(rays, int(2u * ray_index));
    vec4 direction_t_max = texelFetch(rays, int(2u * ray_index + 1u));
    trace_ray r = dead;
    r.origin = origin_t_min.xyz;
    r.direction = direction_t_max.xyz;
    r.t_min = origin_t_min.w;
    r.t_max = direction_t_max.w;
    if (is_alive(r))
        return r;
    return dead;
}

#ifdef ANY_HIT

vec3 found_before(uint ray_index, trace_ray r)
{
#ifdef RAYS_GO_ON
    if (is_first_part == 0u && ray_index < ray_end)
        return optical_depths[ray_index - first_ray].xyz;
#endif
    return vec3(0.0);
}

// A dead ray has full transmittance.
void store_visibility(uint ray_index, vec3 optical_depth)
{
#ifdef RAYS_GO_ON
    if (ray_index < ray_end)
        optical_depths[ray_index - first_ray] = vec4(optical_depth, 0.0);
#endif
    vec3 left = transmittance_left(optical_depth);
    if (ray_index < ray_end)
        visibilities[ray_index] = visibility_of(left);
}

#else

candidate found_before(uint ray_index, trace_ray r)
{
#ifdef RAYS_GO_ON
    if (is_first_part == 0u && ray_index < ray_end) {
        uvec4 before = imageLoad(intersections, int(3u * ray_index));
        if (before.z != HIT_NO_PRIMITIVE)
            return candidate(uintBitsToFloat(before.x), before.z, before.w, vec2(0.0));
    }
#endif
    return candidate_none(r.t_max);
}

void store_intersection(uint ray_index, candidate best)
{
    if (ray_index >= ray_end)
        return;
    float distance_ = best.primitive == HIT_NO_PRIMITIVE ? -1.0 : best.distance;
    imageStore(intersections, int(3u * ray_index),
               uvec4(floatBitsToUint(distance_), INTERSECTION_FLAGS, best.primitive, best.instance_index));
}

#endif

// Whether the dispatch is the first one of its rays.
bool is_new()
{
#ifdef RAYS_GO_ON
    return is_first_part != 0u;
#else
    return true;
#endif
}

#if PACKET_RAYS == 1

void main()
{
    uint ray_index = first_ray + item_index();
    if (ray_index >= ray_end)
        return;
    trace_ray r = load_ray(ray_index);
#ifdef ANY_HIT
    vec3 optical_depth = found_before(ray_index, r);
#ifdef RAYS_GO_ON
    if (min_component(optical_depth) >= OPTICAL_DEPTH_BLACK)
        return;
#endif
    if (is_alive(r) && (is_new() && discs_any(r, optical_depth) || trace_any(r, optical_depth)))
        optical_depth = vec3(OPTICAL_DEPTH_MAX);
    store_visibility(ray_index, optical_depth);
#else
    candidate best = found_before(ray_index, r);
    if (is_alive(r)) {
        if (is_new())
            discs_closest(r, best);
        trace_closest(r, best);
    }
    store_intersection(ray_index, best);
#endif
}

#else

// Work per ray runs in a loop that selects its ray by comparing indices: indexing the arrays by the loop's counter
// would make the compiler unroll all of it (discs, textures, surfaces) PACKET_RAYS times.
#ifdef ANY_HIT
#define found_type vec3 // optical depths
#else
#define found_type candidate
#endif

void look_at_discs(inout trace_ray r[PACKET_RAYS], inout found_type found[PACKET_RAYS])
{
    for (int i = 0; i < PACKET_RAYS; i++) {
        trace_ray r_i = r[0];
        found_type found_i = found[0];
        for (int k = 1; k < PACKET_RAYS; k++) {
            if (k == i) {
                r_i = r[k];
                found_i = found[k];
            }
        }
        if (is_alive(r_i)) {
#ifdef ANY_HIT
            if (discs_any(r_i, found_i)) {
                found_i = vec3(OPTICAL_DEPTH_MAX);
                r_i.t_max = -1.0; // ends the ray
                r_i.t_min = 0.0;
            }
#else
            discs_closest(r_i, found_i);
#endif
        }
        for (int k = 0; k < PACKET_RAYS; k++) {
            if (k == i) {
                r[k] = r_i;
                found[k] = found_i;
            }
        }
    }
}

void main()
{
    uint first = first_ray + item_index() * PACKET_RAYS;
    if (first >= ray_end)
        return;
    trace_ray r[PACKET_RAYS];
    found_type found[PACKET_RAYS];
    bool any_alive = false;
    for (int k = 0; k < PACKET_RAYS; k++) {
        r[k] = load_ray(first + uint(k));
        any_alive = any_alive || is_alive(r[k]);
        found[k] = found_before(first + uint(k), r[k]);
#if defined ANY_HIT && defined RAYS_GO_ON
        if (min_component(found[k]) >= OPTICAL_DEPTH_BLACK) {
            r[k].t_max = -1.0;
            r[k].t_min = 0.0;
        }
#endif
    }
    if (DISC_COUNT > 0u && is_new())
        look_at_discs(r, found);
#ifdef ANY_HIT
    if (any_alive)
        trace_any_rays(r, found);
    for (int k = 0; k < PACKET_RAYS; k++)
        store_visibility(first + uint(k), found[k]);
#else
    if (any_alive)
        trace_closest_rays(r, found);
    for (int k = 0; k < PACKET_RAYS; k++)
        store_intersection(first + uint(k), found[k]);
#endif
}

#endif
