// SPDX-License-Identifier: MIT
// Places of level 0: which ray is where, and how far it goes on.
//
// Defines: ANY_HIT the rays of the wave ask for transmittance.
#include "common/range.glsl"
#include "rayspace/answer.glsl"
#include "rayspace/control.glsl"
#include "rayspace/ray.glsl"

layout(binding = UNIT_RAYSPACE_ORDER) uniform usamplerBuffer order;

uint ray_of_place(uint place)
{
    return control.sorted != 0u ? texelFetch(order, int(place)).x : place;
}

// Farther away a point says nothing of the direction to it.
const float TURNED_MAX = 1e18;

// A ray that was turned round begins at its end, which it has in common with others (section 3.5.1).
live_ray ray_at_place(uint place)
{
    uint ray = ray_of_place(place);
    vec4 origin_t_min = texelFetch(rays, int(2u * ray)), direction_t_max = texelFetch(rays, int(2u * ray + 1u));
    live_ray r = live_ray_of(origin_t_min, direction_t_max, distance_left(ray, direction_t_max.w));
    if (ray >= ray_end)
        r.end = -1.0;
#ifdef ANY_HIT
    if (control.turned != 0u && r.end >= 0.0 && r.end < TURNED_MAX) {
        r.origin += r.end * r.direction;
        r.direction = -r.direction;
        r.slack = max(r.slack, WORLD_SLACK * max_component(abs(r.origin)));
    }
#endif
    return r;
}
