// SPDX-License-Identifier: MIT
// Intersection of a ray's line with a triangle's plane, also beside the triangle: samples of triangles are verified with
// it.
#include "common/intersection.glsl"

// Intersection of a line with the plane of an instance's triangle, in object space.
struct line_intersection {
    vec3 v0, v1, v2; // from the ray's origin
    vec3 weights;    // barycentric, where the line intersects the triangle's plane
    float distance;  // distance of the intersection
    bool from_behind;
};

line_intersection intersect_line_triangle(vec3 o, vec3 d, uint primitive)
{
    line_intersection c;
    uvec4 triangle = texelFetch(triangles, int(primitive));
    c.v0 = texelFetch(positions, int(triangle.x)).xyz - o;
    c.v1 = texelFetch(positions, int(triangle.y)).xyz - o;
    c.v2 = texelFetch(positions, int(triangle.z)).xyz - o;
    vec3 w = edge_weights(d, c.v0, c.v1, c.v2);
    float sum = w.x + w.y + w.z;
    c.weights = sum != 0.0 ? w / sum : vec3(-1.0);
    vec3 normal = cross(c.v1 - c.v0, c.v2 - c.v0);
    float slope = dot(normal, d);
    c.distance = slope != 0.0 ? dot(normal, c.v0) / slope : -1.0;
    c.from_behind = slope > 0.0;
    return c;
}

bool has_corner(line_intersection c, vec3 v)
{
    return c.v0 == v || c.v1 == v || c.v2 == v;
}

// Whether the edge beyond which the line passes the one triangle is also an edge of the other.
bool is_beyond_edge_of(line_intersection c, line_intersection other)
{
    bvec3 has = bvec3(has_corner(other, c.v0), has_corner(other, c.v1), has_corner(other, c.v2));
    return c.weights.x < 0.0 && has.y && has.z || c.weights.y < 0.0 && has.z && has.x || c.weights.z < 0.0 && has.x && has.y;
}
