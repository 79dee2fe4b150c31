// SPDX-License-Identifier: MIT
// Finds the primitive of a sample, and the point on it.
#include "abuffer/layout.h"
#include "raster/layout.h"
#include "shared/bindings.h"
#include "common/intersection.glsl"
#include "common/alpha.glsl"

layout(binding = UNIT_TRACER_3) uniform usamplerBuffer abuffer_ids;
layout(binding = UNIT_TRACER_4) uniform usamplerBuffer abuffer_drawn;

uniform int abuffer_drawn_count;

// The drawn instance that has a primitive's id: the last one whose first id is not greater.
int drawn_of(uint id)
{
    int first = 0, end = abuffer_drawn_count - 1;
    while (first < end) {
        int middle = (first + end + 1) >> 1;
        bool is_beyond = texelFetch(abuffer_drawn, middle).x > id;
        first = is_beyond ? first : middle;
        end = is_beyond ? middle - 1 : end;
    }
    return first;
}

candidate candidate_of_sample(int sample_index, float distance_)
{
    uint id = texelFetch(abuffer_ids, sample_index).x;
    uvec4 drawn = texelFetch(abuffer_drawn, drawn_of(id));
    return candidate(distance_, id - drawn.y, drawn.z, vec2(0.0));
}

bool is_of_spheres(candidate c)
{
#ifdef HAS_SPHERES
    return geometry_at(instance_at(c.instance_index).geometry).kind == GEOMETRY_SPHERES;
#else
    return false;
#endif
}

// Approximate barycentrics of the triangle's point nearest to the intersection: a sample's plane extends beyond its
// primitive.
vec2 nearest_barycentrics(candidate c, vec3 origin_world, vec3 direction_world)
{
    if (is_of_spheres(c))
        return vec2(0.0);
    instance i = instance_at(c.instance_index);
    uvec4 triangle = texelFetch(triangles, int(c.primitive));
    vec3 p0 = texelFetch(positions, int(triangle.x)).xyz;
    vec3 e1 = texelFetch(positions, int(triangle.y)).xyz - p0, e2 = texelFetch(positions, int(triangle.z)).xyz - p0;
    vec3 place = affine_point(i.object_from_world, origin_world) +
                 c.distance * affine_vector(i.object_from_world, direction_world) - p0;
    vec3 normal = cross(e1, e2);
    float area = dot(normal, normal);
    if (!(area > 0.0))
        return vec2(1.0 / 3.0);
    vec2 b = vec2(dot(cross(place, e2), normal), dot(cross(e1, place), normal)) / area;
    vec3 weights = max(triangle_weights(b), vec3(0.0));
    return weights.yz / (weights.x + weights.y + weights.z);
}
