// SPDX-License-Identifier: MIT
// Places of level 0: which ray is where, and how far it goes on.
//
// Defines:
//   ANY_HIT         the rays of the wave ask for transmittance
//   RAYSPACE_ORDER  the rays are sorted
#include "rayspace/ray.glsl"
#include "common/range.glsl"
#include "rayspace/answer.glsl"

#ifdef RAYSPACE_ORDER
layout(binding = UNIT_RAYSPACE_ORDER) uniform usamplerBuffer order;
#endif

uint ray_of_place(uint place)
{
#ifdef RAYSPACE_ORDER
    return texelFetch(order, int(place)).x;
#else
    return place;
#endif
}

live_ray ray_at_place(uint place)
{
    uint ray = ray_of_place(place);
    vec4 origin_t_min = texelFetch(rays, int(2u * ray)), direction_t_max = texelFetch(rays, int(2u * ray + 1u));
    live_ray r = live_ray_of(origin_t_min, direction_t_max, distance_left(ray, direction_t_max.w));
    if (ray >= ray_end)
        r.end = -1.0;
    return r;
}
