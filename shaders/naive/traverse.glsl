// SPDX-License-Identifier: MIT
// Tests every primitive of every instance for every ray: the ground truth for the structures. Keep it as simple as
// possible.
#include "common/candidate.glsl"

uniform uint instance_count;

#ifdef ANY_HIT
bool trace_any(trace_ray r, inout vec3 optical_depth)
{
    for (uint i = 0u; i < instance_count; i++) {
        object_ray o = object_from_world_ray(r, i);
        geometry g = geometry_at(instance_at(i).geometry);
        for (uint p = g.first_primitive; p < g.first_primitive + g.primitive_count; p++) {
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
    }
    return false;
}
#else
void trace_closest(trace_ray r, inout candidate best)
{
    for (uint i = 0u; i < instance_count; i++) {
        object_ray o = object_from_world_ray(r, i);
        geometry g = geometry_at(instance_at(i).geometry);
        for (uint p = g.first_primitive; p < g.first_primitive + g.primitive_count; p++) {
#ifdef HAS_SPHERES
            if (g.kind == GEOMETRY_SPHERES) {
                visit_sphere_closest(r, o, p, i, best);
                continue;
            }
#endif
            visit_triangle_closest(r, o, p, i, best);
        }
    }
}
#endif
