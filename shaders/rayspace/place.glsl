// SPDX-License-Identifier: MIT
// Places of level 0: the ray at each, and the distance up to which it matters.
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

// Maximum length of a reversed ray: rounding at a point farther away would lose the direction.
const float TURNED_MAX = 1e18;

// Ray at a place. A reversed ray begins at its end, which it shares with others (section 3.5.1).
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
