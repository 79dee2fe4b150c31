// SPDX-License-Identifier: MIT
// Tests of discs, which no acceleration structure holds.
//
// Defines: ANY_HIT, HAS_DISCS, those of common/candidate.glsl.
#include "common/candidate.glsl"

uniform uint disc_count;
#ifdef HAS_DISCS
#define DISC_COUNT disc_count
#else
#define DISC_COUNT 0u
#endif

#ifdef ANY_HIT

bool discs_any(trace_ray r, inout vec3 optical_depth)
{
    for (uint i = 0u; i < DISC_COUNT; i++) {
        candidate found = candidate(0.0, i, HIT_NO_PRIMITIVE, vec2(0.0));
        disc d = disc_at(i);
        if (intersect_disc(r.origin, r.direction, d.centre_radius.xyz, d.normal.xyz, d.centre_radius.w,
                           found.distance) &&
            offer_any(r, found, optical_depth))
            return true;
    }
    return false;
}

#else

void discs_closest(trace_ray r, inout candidate best)
{
    for (uint i = 0u; i < DISC_COUNT; i++) {
        candidate found = candidate(0.0, i, HIT_NO_PRIMITIVE, vec2(0.0));
        disc d = disc_at(i);
        if (intersect_disc(r.origin, r.direction, d.centre_radius.xyz, d.normal.xyz, d.centre_radius.w,
                           found.distance))
            offer_closest(r, found, best);
    }
}

#endif
