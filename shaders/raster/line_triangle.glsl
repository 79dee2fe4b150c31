// SPDX-License-Identifier: MIT
// The line of a ray and a triangle, also where it passes it: what samples of triangles are verified with.
#include "common/intersection.glsl"

// Of a triangle of one instance, in whose object space the ray is.
struct line_intersection {
    vec3 v0, v1, v2; // from the ray's origin
    vec3 weights;    // barycentric, where the line intersects the triangle's plane
    float distance;  // there
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

// Whether the edge beyond which the line passes the one triangle is an edge of the other, too.
bool is_beyond_edge_of(line_intersection c, line_intersection other)
{
    bvec3 has = bvec3(has_corner(other, c.v0), has_corner(other, c.v1), has_corner(other, c.v2));
    return c.weights.x < 0.0 && has.y && has.z || c.weights.y < 0.0 && has.z && has.x || c.weights.z < 0.0 && has.x && has.y;
}
