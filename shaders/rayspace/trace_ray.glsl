// SPDX-License-Identifier: MIT
// Converts a ray of a wave for tests of primitives.
//
// Defines: HAS_MOTION.
#include "common/candidate.glsl"
#include "rayspace/layout.h"
#include "rayspace/ray.glsl"

#ifdef HAS_MOTION
layout(std430, binding = BIND_RAYSPACE_TIMES) readonly buffer time_block { float ray_times[]; };
#endif

trace_ray trace_ray_of(uint ray)
{
    vec4 origin_t_min = texelFetch(rays, int(2u * ray)), direction_t_max = texelFetch(rays, int(2u * ray + 1u));
    trace_ray r;
    r.origin = origin_t_min.xyz;
    r.direction = direction_t_max.xyz;
    r.t_min = origin_t_min.w;
    r.t_max = direction_t_max.w;
#ifdef HAS_MOTION
    r.time = ray_times[ray];
#endif
    return r;
}
