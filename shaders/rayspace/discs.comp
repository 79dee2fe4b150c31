// SPDX-License-Identifier: MIT
// Tests discs before the descent: rays end at the nearest disc, or lose all light behind one, so that nodes need not
// extend beyond it. The answer itself is made at the end (trace/wave.comp), where discs come before primitives at one
// distance.
//
// Defines: those of common/discs.glsl and rayspace/trace_ray.glsl.
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "rayspace/answer.glsl"
#include "rayspace/trace_ray.glsl"
#include "common/discs.glsl"

void main()
{
    uint ray = first_ray + item_index();
    if (ray >= ray_end)
        return;
    trace_ray r = trace_ray_of(ray);
    if (!(r.t_max > r.t_min))
        return;
#ifdef ANY_HIT
    vec3 optical_depth = vec3(0.0);
    if (discs_any(r, optical_depth))
        answers[ray].xyz = uvec3(OPTICAL_DEPTH_MAX);
#else
    candidate best = candidate_none(r.t_max);
    discs_closest(r, best);
    if (best.primitive != HIT_NO_PRIMITIVE)
        answers[ray].x = ordered_bits(best.distance);
#endif
}
