// SPDX-License-Identifier: MIT
// Makes a batch of primitives for the flat descent: bounds of each, and its pair with the root of the hierarchy. No batch
// is kept: the first picture costs as much as any other.
//
// Defines: HAS_MOTION.
#include "common/dispatch.glsl"
#include "common/motion.glsl"
#include "rayspace/rank.glsl"

layout(std430, binding = BIND_RAYSPACE_ITEMS) writeonly buffer item_block { uvec4 items_written[]; };
layout(std430, binding = BIND_RAYSPACE_PAIRS) writeonly buffer pair_block { uvec4 pairs_written[]; };

uniform uint batch_first, batch_count; // ranks
uniform uint root;                     // node

// Hull of the corners on their way from one pose to the next: a point stays within the hull of its places in the poses,
// at shutter open and close.
struct hull {
    vec3 lower, upper;
};

void include(inout hull h, vec4 rows[3], vec3 centre, vec3 half_size)
{
    for (int row = 0; row < 3; row++) {
        vec3 m = rows[row].xyz;
        float middle = dot(m, centre) + rows[row].w, half_ = half_size.x == 0.0 ? 0.0 : half_size.x * length(m);
        half_ += 1.9073e-6 * (dot(abs(m), abs(centre)) + abs(rows[row].w) + half_); // rounding, 2^-19
        h.lower[row] = min(h.lower[row], middle - half_);
        h.upper[row] = max(h.upper[row], middle + half_);
    }
}

// Smallest sphere round a triangle: half the longest edge, or the circumsphere where all angles are acute.
vec4 sphere_around(vec3 a, vec3 b, vec3 c)
{
    vec3 squared = vec3(dot(b - c, b - c), dot(c - a, c - a), dot(a - b, a - b));
    vec3 from = squared.x >= squared.y && squared.x >= squared.z ? a : squared.y >= squared.z ? b : c;
    vec3 s = from == a ? b : a, t = from == c ? b : c;
    vec3 centre = 0.5 * s + 0.5 * t;
    if (distance(from, centre) > 0.5 * distance(s, t)) {
        vec3 u = s - from, v = t - from, n = cross(u, v);
        vec3 to_centre = cross(dot(u, u) * v - dot(v, v) * u, n) / (2.0 * dot(n, n));
        if (dot(to_centre, to_centre) < dot(squared, vec3(1.0))) // false for a triangle seen on edge
            centre = from - to_centre;
    }
    return vec4(centre, max(distance(a, centre), max(distance(b, centre), distance(c, centre))));
}

void main()
{
    uint item = item_index();
    if (item >= batch_count)
        return;
    uint rank = batch_first + item, instance_index = instance_of_rank(rank);
    uint number = rank - first_rank_of(instance_index);
    instance i = instance_at(instance_index);
    geometry g = geometry_at(i.geometry);
    hull h = hull(vec3(3e38), vec3(-3e38));
    vec3 corners[6];
    uint corner_count = 3u;
    float radius = 0.0;
    if (g.kind == GEOMETRY_SPHERES) {
        vec4 sphere = texelFetch(spheres, int(g.first_primitive + number));
        corners[0] = sphere.xyz;
        radius = sphere.w;
        corner_count = 1u;
    } else {
        uvec3 vertices = texelFetch(triangles, int(g.first_primitive + number)).xyz;
        for (int k = 0; k < 3; k++)
            corners[k] = texelFetch(positions, int(vertices[k])).xyz;
#ifdef HAS_MOTION
        if (g.close_offset != 0u) {
            corner_count = 6u;
            for (int k = 0; k < 3; k++)
                corners[3 + k] = texelFetch(positions, int(vertices[k] + g.close_offset)).xyz;
        }
#endif
    }
    for (uint k = 0u; k < corner_count; k++)
        include(h, i.world_from_object, corners[k], vec3(radius));
    bool moves = corner_count == 6u;
#ifdef HAS_MOTION
    uint poses = i.motion != 0u ? i.flags >> INSTANCE_POSES_SHIFT & INSTANCE_POSES_MASK : 0u;
    for (uint pose = 1u; pose < poses; pose++) {
        int texel = int(i.motion - 1u + 3u * pose);
        vec4 rows[3] = vec4[3](texelFetch(motions, texel), texelFetch(motions, texel + 1), texelFetch(motions, texel + 2));
        for (uint k = 0u; k < corner_count; k++)
            include(h, rows, corners[k], vec3(radius));
        moves = true;
    }
#endif
    vec3 half_size = 0.5 * h.upper - 0.5 * h.lower;
    vec4 sphere = vec4(h.lower + half_size, length(half_size) * 1.000004);
    if (corner_count == 3u && !moves) {
        vec3 a = affine_point(i.world_from_object, corners[0]), b = affine_point(i.world_from_object, corners[1]);
        vec4 smaller = sphere_around(a, b, affine_point(i.world_from_object, corners[2]));
        smaller.w = smaller.w * 1.000004 + 1.9073e-6 * max_component(abs(h.lower) + abs(h.upper));
        if (smaller.w < sphere.w)
            sphere = smaller;
    }
    items_written[3u * item] = floatBitsToUint(sphere);
    items_written[3u * item + 1u] = uvec4(floatBitsToUint(h.lower), instance_index);
    items_written[3u * item + 2u] = uvec4(floatBitsToUint(h.upper), number);
    pairs_written[item] = uvec4(root, item, 0u, 0u);
}
