// SPDX-License-Identifier: MIT
// Intersection of a pixel's ray with the primitive that the rasteriser drew there.
//
// At an edge the exact test may just miss what the rasteriser drew (common/intersection.glsl).
//
// Defines: HAS_SPHERES, HAS_CUTOUT as the scene has them.

#include "common/alpha.glsl"
#include "common/intersection.glsl"
#include "common/intersect.glsl"

#ifdef HAS_SPHERES
// Nearest point of a sphere beyond t_min that is not cut out; distance below 0: there is none.
candidate candidate_sphere(uint instance_index, uint primitive, vec3 origin, vec3 direction, float t_min)
{
    vec4 rows[3] = instance_at(instance_index).object_from_world;
    vec4 sphere = texelFetch(spheres, int(primitive));
    candidate found = candidate(-1.0, primitive, instance_index, vec2(0.0));
    vec2 distances;
    if (!intersect_sphere(affine_point(rows, origin), affine_vector(rows, direction), sphere.xyz, sphere.w,
                          distances))
        return found;
    for (int i = 0; i < 2; i++) {
        found.distance = distances[i];
        if (found.distance > t_min && !is_cut_out(found, origin, direction, 0.0))
            return found;
    }
    found.distance = -1.0;
    return found;
}
#endif

candidate candidate_disc(uint disc_index, vec3 origin, vec3 direction)
{
    disc d = disc_at(disc_index);
    candidate found = candidate(0.0, disc_index, HIT_NO_PRIMITIVE, vec2(0.0));
    intersect_disc(origin, direction, d.centre_radius.xyz, d.normal.xyz, d.centre_radius.w, found.distance);
    return found;
}
