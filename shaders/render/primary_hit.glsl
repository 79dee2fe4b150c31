// SPDX-License-Identifier: MIT
// A pixel's ray against the one primitive that the rasteriser saw there.
//
// The rasteriser decides by its own rounding which primitive covers a pixel, so at an edge the exact test may
// just miss what it drew: the place is then moved to the nearest of the primitive's own.
//
// Defines: HAS_SPHERES, HAS_CUTOUT as the scene has them.

#include "common/alpha.glsl"
#include "common/intersect.glsl"

vec3 clamped_weights(vec3 direction, vec3 v0, vec3 v1, vec3 v2)
{
    vec3 w = vec3(dot(cross(v2 - v1, v2 + v1), direction), dot(cross(v0 - v2, v0 + v2), direction),
                  dot(cross(v1 - v0, v1 + v0), direction));
    float sum = w.x + w.y + w.z;
    if (sum == 0.0)
        return vec3(1.0 / 3.0);
    w = max(w / sum, vec3(0.0));
    return w / (w.x + w.y + w.z);
}

candidate candidate_triangle(uint instance_index, uint primitive, vec3 origin, vec3 direction)
{
    vec4 rows[3] = instances[instance_index].object_from_world;
    vec3 o = affine_point(rows, origin), d = affine_vector(rows, direction);
    uvec4 triangle = texelFetch(triangles, int(primitive));
    vec3 v0 = texelFetch(positions, int(triangle.x)).xyz - o;
    vec3 v1 = texelFetch(positions, int(triangle.y)).xyz - o;
    vec3 v2 = texelFetch(positions, int(triangle.z)).xyz - o;
    candidate found = candidate(0.0, primitive, instance_index, vec2(0.0));
    if (intersect_triangle(d, v0, v1, v2, found.distance, found.barycentrics))
        return found;
    vec3 weights = clamped_weights(d, v0, v1, v2);
    found.barycentrics = weights.yz;
    vec3 place = v0 * weights.x + v1 * weights.y + v2 * weights.z;
    found.distance = dot(place, d) / dot(d, d); // of the point of the ray that is nearest to it
    return found;
}

#ifdef HAS_SPHERES
// The nearest place of a sphere beyond t_min that is not cut out; distance below 0: there is none.
candidate candidate_sphere(uint instance_index, uint primitive, vec3 origin, vec3 direction, float t_min)
{
    vec4 rows[3] = instances[instance_index].object_from_world;
    vec4 sphere = texelFetch(spheres, int(primitive));
    candidate found = candidate(-1.0, primitive, instance_index, vec2(0.0));
    vec2 distances;
    if (!intersect_sphere(affine_point(rows, origin), affine_vector(rows, direction), sphere.xyz, sphere.w,
                          distances))
        return found;
    for (int i = 0; i < 2; i++) {
        found.distance = distances[i];
        if (found.distance > t_min && !is_cut_out(found, origin, direction))
            return found;
    }
    found.distance = -1.0;
    return found;
}
#endif

candidate candidate_disc(uint disc_index, vec3 origin, vec3 direction)
{
    disc d = discs[disc_index];
    candidate found = candidate(0.0, disc_index, HIT_NO_PRIMITIVE, vec2(0.0));
    intersect_disc(origin, direction, d.centre_radius.xyz, d.normal.xyz, d.centre_radius.w, found.distance);
    return found;
}
