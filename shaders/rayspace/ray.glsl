// SPDX-License-Identifier: MIT
// Rays of a wave as level 0 of the hierarchy.
#include "rayspace/layout.h"
#include "shared/bindings.h"
#include "common/math.glsl"
#include "tree/slack.glsl"

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // two texels per ray

const float DIRECTION_SLACK = 9.5367431640625e-7; // 2^-20

// A bundle of rays, with the bounds for its tests.
struct bundle {
    vec3 centre;
    float radius; // radius of the origins
    vec3 axis;
    float secant, tangent; // secant 0: no cone
    vec3 origin_lower, origin_upper;
    vec3 direction_lower, direction_upper;
    float end; // metres; negative: every ray is dead
};

struct live_ray {
    vec3 origin, direction; // unit
    float end;              // metres along it; negative: dead
    float slack;            // rounding error of its position
};

// Makes the ray, up to `t_max`, which may be less than its own. A ray that begins behind its origin is cut there.
live_ray live_ray_of(vec4 origin_t_min, vec4 direction_t_max, float t_max)
{
    float largest = max_component(abs(direction_t_max.xyz));
    vec3 scaled = direction_t_max.xyz / largest;
    float length_ = length(scaled) * largest, before = min(origin_t_min.w, 0.0);
    live_ray r;
    r.origin = origin_t_min.xyz + before * direction_t_max.xyz;
    r.direction = scaled / length(scaled);
    r.slack = WORLD_SLACK * max(max_component(abs(origin_t_min.xyz)), max_component(abs(r.origin)));
    r.end = min((t_max - before) * length_ * PRUNE_SLACK, 3e38);
    // NaN too: every comparison with it is false
    if (!(t_max > origin_t_min.w && length_ > 0.0 && max_component(abs(r.origin)) < 3e38))
        r.end = -1.0;
    return r;
}

live_ray live_ray_at(uint ray)
{
    vec4 direction_t_max = texelFetch(rays, int(2u * ray + 1u));
    return live_ray_of(texelFetch(rays, int(2u * ray)), direction_t_max, direction_t_max.w);
}

bundle bundle_of_ray(live_ray r)
{
    return bundle(r.origin, r.slack * 2.0, r.direction, 1.0, DIRECTION_SLACK * 4.0, r.origin - r.slack,
                  r.origin + r.slack, r.direction - DIRECTION_SLACK, r.direction + DIRECTION_SLACK, r.end);
}
