// SPDX-License-Identifier: MIT
// Intersection of a ray with the triangle that it is known to hit.
//
// A rasteriser, and a traversal that tests triangles relative to another point than the ray's origin, decide by their
// own rounding which triangle is hit, so at an edge the exact test may just miss it: the point is then moved to the
// nearest one of the triangle.
#include "common/intersect.glsl"
#include "common/attributes.glsl"

// Barycentric weights of the vertices (relative to the ray's origin) at the intersection of the ray's line with their
// plane; not normalised.
vec3 edge_weights(vec3 direction, vec3 v0, vec3 v1, vec3 v2)
{
    return vec3(dot(cross(v2 - v1, v2 + v1), direction), dot(cross(v0 - v2, v0 + v2), direction),
                dot(cross(v1 - v0, v1 + v0), direction));
}

vec3 clamped_weights(vec3 direction, vec3 v0, vec3 v1, vec3 v2)
{
    vec3 w = edge_weights(direction, v0, v1, v2);
    float sum = w.x + w.y + w.z;
    if (sum == 0.0)
        return vec3(1.0 / 3.0);
    w = max(w / sum, vec3(0.0));
    return w / (w.x + w.y + w.z);
}

candidate candidate_triangle(uint instance_index, uint primitive, vec3 origin, vec3 direction, float time)
{
    instance i = instance_at_time(instance_index, time);
    uint close_offset = close_offset_of(i.geometry);
    vec3 o = affine_point(i.object_from_world, origin), d = affine_vector(i.object_from_world, direction);
    uvec4 triangle = texelFetch(triangles, int(primitive));
    vec3 v0 = position_at_time(triangle.x, close_offset, time) - o;
    vec3 v1 = position_at_time(triangle.y, close_offset, time) - o;
    vec3 v2 = position_at_time(triangle.z, close_offset, time) - o;
    candidate found = candidate(0.0, primitive, instance_index, vec2(0.0));
    if (intersect_triangle(d, v0, v1, v2, found.distance, found.barycentrics))
        return found;
    vec3 weights = clamped_weights(d, v0, v1, v2);
    found.barycentrics = weights.yz;
    vec3 place = v0 * weights.x + v1 * weights.y + v2 * weights.z;
    found.distance = dot(place, d) / dot(d, d); // distance of the ray's point nearest to it
    return found;
}
