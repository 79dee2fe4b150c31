// SPDX-License-Identifier: MIT
// Tests every primitive of every instance for every ray: the ground truth for the structures. Keep it as simple as
// possible.
//
// Defines: NAIVE_PARTS there are more primitives than one dispatch tests (trace/naive/parts.h).
#include "common/candidate.glsl"

uniform uint instance_count;
// Beginning of the part, and its number of tests: entering an instance is one.
uniform uint part_first_instance, part_first_primitive, part_tests;

#ifdef NAIVE_PARTS
#define RAYS_GO_ON
#endif

#ifdef ANY_HIT
bool trace_any(trace_ray r, inout vec3 optical_depth)
{
    uint first = part_first_primitive, left = part_tests;
    for (uint i = part_first_instance; left > 0u && i < instance_count; i++) {
        object_ray o = object_from_world_ray(r, i);
        geometry g = geometry_at(instance_at(i).geometry);
        uint count = min(g.primitive_count - first, left - 1u);
        for (uint p = g.first_primitive + first, end = p + count; p < end; p++) {
#ifdef HAS_SPHERES
            if (g.kind == GEOMETRY_SPHERES) {
                if (visit_sphere_any(r, o, p, i, optical_depth))
                    return true;
                continue;
            }
#endif
            if (visit_triangle_any(r, o, p, i, optical_depth))
                return true;
        }
        left -= 1u + count;
        first = 0u;
    }
    return false;
}
#else
void trace_closest(trace_ray r, inout candidate best)
{
    uint first = part_first_primitive, left = part_tests;
    for (uint i = part_first_instance; left > 0u && i < instance_count; i++) {
        object_ray o = object_from_world_ray(r, i);
        geometry g = geometry_at(instance_at(i).geometry);
        uint count = min(g.primitive_count - first, left - 1u);
        for (uint p = g.first_primitive + first, end = p + count; p < end; p++) {
#ifdef HAS_SPHERES
            if (g.kind == GEOMETRY_SPHERES) {
                visit_sphere_closest(r, o, p, i, best);
                continue;
            }
#endif
            visit_triangle_closest(r, o, p, i, best);
        }
        left -= 1u + count;
        first = 0u;
    }
}
#endif
