// SPDX-License-Identifier: MIT
// Tests of primitives that an exact tracer's structure leads to.
#include "common/alpha.glsl"
#include "common/intersect.glsl"
#include "common/optical_depth.glsl"
#include "shared/ray.h"

// A ray during traversal. World space; `t_max` shrinks to the closest hit so far.
struct trace_ray {
    vec3 origin;
    vec3 direction;
    float t_min;
    float t_max;
#ifdef HAS_MOTION
    float time;
#endif
};

// Without motion rays carry no time.
float time_of(trace_ray r)
{
#ifdef HAS_MOTION
    return r.time;
#else
    return 0.0;
#endif
}

// A ray in an instance's space: the direction is not normalised, so distances stay those of the world.
struct object_ray {
    vec3 origin;
    vec3 direction;
};

object_ray object_from_world_ray(trace_ray r, uint instance_index)
{
    vec4 rows[3] = instance_at_time(instance_index, time_of(r)).object_from_world;
    return object_ray(affine_point(rows, r.origin), affine_vector(rows, r.direction));
}

candidate candidate_none(float t_max)
{
    return candidate(t_max, HIT_NO_PRIMITIVE, HIT_NO_PRIMITIVE, vec2(0.0));
}

// Closest hit: accepts the candidate if it is nearer than the best and not cut away.
void offer_closest(trace_ray r, candidate found, inout candidate best)
{
    if (found.distance > r.t_min && found.distance < best.distance &&
        !is_cut_out(found, r.origin, r.direction, time_of(r)))
        best = found;
}

// Any hit: adds the candidate's optical depth. True: no light is left, and the ray is finished. A surface counts once for
// each intersection, so no primitive may be offered twice to one ray.
bool offer_any(trace_ray r, candidate found, inout vec3 optical_depth)
{
    if (!(found.distance > r.t_min && found.distance < r.t_max))
        return false;
#if defined HAS_CUTOUT || defined HAS_TRANSLUCENT
    vec3 transmittance = transmittance_of(found, r.origin, r.direction, time_of(r), r.t_min == RAY_STOPS_T_MIN);
    optical_depth = min(optical_depth + optical_depth_of(transmittance), vec3(OPTICAL_DEPTH_MAX));
    return min_component(optical_depth) >= OPTICAL_DEPTH_BLACK;
#else
    optical_depth = vec3(OPTICAL_DEPTH_MAX);
    return true;
#endif
}

bool intersect_primitive(trace_ray r, object_ray o, uint primitive, uint instance_index, out candidate found)
{
    uint close_offset = 0u;
#ifdef HAS_MOTION
    close_offset = close_offset_of(instance_at(instance_index).geometry);
#endif
    float time = time_of(r);
    uvec4 triangle = texelFetch(triangles, int(primitive));
    found = candidate(0.0, primitive, instance_index, vec2(0.0));
    return intersect_triangle(o.direction, position_at_time(triangle.x, close_offset, time) - o.origin,
                              position_at_time(triangle.y, close_offset, time) - o.origin,
                              position_at_time(triangle.z, close_offset, time) - o.origin, found.distance,
                              found.barycentrics);
}

// Tests the triangle or sphere against the ray in the instance's space `o`.
void visit_triangle_closest(trace_ray r, object_ray o, uint primitive, uint instance_index, inout candidate best)
{
    candidate found;
    if (intersect_primitive(r, o, primitive, instance_index, found))
        offer_closest(r, found, best);
}

bool visit_triangle_any(trace_ray r, object_ray o, uint primitive, uint instance_index, inout vec3 optical_depth)
{
    candidate found;
    return intersect_primitive(r, o, primitive, instance_index, found) && offer_any(r, found, optical_depth);
}

void visit_sphere_closest(trace_ray r, object_ray o, uint primitive, uint instance_index, inout candidate best)
{
    vec4 sphere = texelFetch(spheres, int(primitive));
    vec2 distances;
    if (!intersect_sphere(o.origin, o.direction, sphere.xyz, sphere.w, distances))
        return;
    for (int side = 0; side < 2; side++) {
        float distance = side == 0 ? distances.x : distances.y;
        offer_closest(r, candidate(distance, primitive, instance_index, vec2(0.0)), best);
    }
}

bool visit_sphere_any(trace_ray r, object_ray o, uint primitive, uint instance_index, inout vec3 optical_depth)
{
    vec4 sphere = texelFetch(spheres, int(primitive));
    vec2 distances;
    if (!intersect_sphere(o.origin, o.direction, sphere.xyz, sphere.w, distances))
        return false;
    for (int side = 0; side < 2; side++) {
        float distance = side == 0 ? distances.x : distances.y;
        if (offer_any(r, candidate(distance, primitive, instance_index, vec2(0.0)), optical_depth))
            return true;
    }
    return false;
}
