// SPDX-License-Identifier: MIT
// Makes one level of the hierarchy over the rays of a wave from the level below it, like mip levels (section 3.2). An
// invocation makes a node.
//
// Defines: ANY_HIT the rays of the wave ask for transmittance; NODES_OF_RAYS level 1, from the rays.
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "rayspace/ray.glsl"
#include "rayspace/place.glsl"

layout(binding = UNIT_RAYSPACE_NODES) uniform samplerBuffer nodes;
layout(std430, binding = BIND_RAYSPACE_NODES) writeonly buffer node_block { vec4 node_texels[]; };

uniform uint below_first, below_count; // nodes of the level below, or rays
uniform uint own_first, own_count;

// Maximum half angle of a cone; a wider one culls nothing that boxes do not.
const float SPREAD_MAX = 1.5;

struct child {
    vec3 centre;
    float radius;
    vec3 axis;
    float spread; // radians; above SPREAD_MAX: no cone
    vec3 origin_lower, origin_upper;
    vec3 direction_lower, direction_upper;
    float end;
};

child child_at(uint index)
{
#ifdef NODES_OF_RAYS
    live_ray r = ray_at_place(index);
    return child(r.origin, 2.0 * r.slack, r.direction, 0.0, r.origin - r.slack, r.origin + r.slack,
                 r.direction - DIRECTION_SLACK, r.direction + DIRECTION_SLACK, r.end);
#else
    int texel = int(below_first + index) * RAYSPACE_NODE_TEXELS;
    vec4 centre_radius = texelFetch(nodes, texel), axis_secant = texelFetch(nodes, texel + 1);
    vec4 lower = texelFetch(nodes, texel + 2), upper = texelFetch(nodes, texel + 3);
    vec4 direction_lower = texelFetch(nodes, texel + 4), direction_upper = texelFetch(nodes, texel + 5);
    return child(centre_radius.xyz, centre_radius.w, axis_secant.xyz, direction_lower.w, lower.xyz, upper.xyz,
                 direction_lower.xyz, direction_upper.xyz, upper.w);
#endif
}

// Upper bound, up to 1.1 % too large, of the angle that a chord of the unit sphere spans: the refined Shafer-Fink
// inequality, as asin() of a device may be off by 2^-11. It is exact also for small angles, where the cosine is not.
float angle_above(float chord)
{
    float sine = min(0.5 * chord, 1.0);
    return 2.0 * PI * sine / (2.0 + (PI - 2.0) * sqrt(1.0 - sine * sine));
}

void main()
{
    uint own = item_index();
    if (own >= own_count)
        return;
    uint first = own * RAYSPACE_NODE_CHILDREN, end = min(first + RAYSPACE_NODE_CHILDREN, below_count);
    int texel = int(own_first + own) * RAYSPACE_NODE_TEXELS;
    child all = child(vec3(0.0), 0.0, vec3(0.0), 0.0, vec3(3e38), vec3(-3e38), vec3(3e38), vec3(-3e38), -1.0);
    for (uint i = first; i < end; i++) {
        child c = child_at(i);
        if (c.end < 0.0)
            continue;
        all.origin_lower = min(all.origin_lower, c.origin_lower);
        all.origin_upper = max(all.origin_upper, c.origin_upper);
        all.direction_lower = min(all.direction_lower, c.direction_lower);
        all.direction_upper = max(all.direction_upper, c.direction_upper);
        all.axis += c.axis;
        all.end = max(all.end, c.end);
    }
    all.centre = 0.5 * all.origin_lower + 0.5 * all.origin_upper;
    float length_ = length(all.axis);
    all.axis = length_ > 1e-3 ? all.axis / length_ : vec3(0.0, 0.0, 1.0);
    for (uint i = first; i < end; i++) {
        child c = child_at(i);
        if (c.end < 0.0)
            continue;
        all.radius = max(all.radius, distance(c.centre, all.centre) + c.radius);
        all.spread = max(all.spread, angle_above(distance(all.axis, c.axis)) + c.spread);
    }
    // The boxes are exact, and spheres and cones of unions are not: the smaller of both counts. The farthest corner of
    // the box of directions is at a chord of the unit sphere from the axis.
    vec3 farthest = max(abs(all.direction_lower - all.axis), abs(all.direction_upper - all.axis));
    all.radius = min(all.radius, distance(all.origin_lower, all.origin_upper) * 0.5);
    all.spread = min(all.spread, angle_above(length(farthest)));
    bool has_cone = all.spread < SPREAD_MAX && length_ > 1e-3;
    all.radius *= 1.0 + 3.8147e-6; // 2^-18
    all.spread += 4.0 * DIRECTION_SLACK;
    node_texels[texel] = vec4(all.centre, all.radius);
    node_texels[texel + 1] = vec4(all.axis, has_cone ? 1.0 / cos(all.spread) : 0.0);
    node_texels[texel + 2] = vec4(all.origin_lower, has_cone ? tan(all.spread) : 0.0);
    node_texels[texel + 3] = vec4(all.origin_upper, all.end);
    node_texels[texel + 4] = vec4(all.direction_lower, has_cone ? all.spread : 4.0);
    node_texels[texel + 5] = vec4(all.direction_upper, 0.0);
}
