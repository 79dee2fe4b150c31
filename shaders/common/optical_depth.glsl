// SPDX-License-Identifier: MIT
// Optical depths of shadow rays, as exact sums.
// Define: HAS_TRANSLUCENT some material lets shadow rays pass.
#include "common/math.glsl"

// Optical depth of a shadow ray so far, per channel: -log2 of the transmittance in steps of 2^-19, as integers in floats.
// Their sums are exact, so unlike a product of floats the answer does not depend on the order of the surfaces.
const float OPTICAL_DEPTH_STEPS = 524288.0;
const float OPTICAL_DEPTH_MAX = 8388607.0;   // maximum: twice as much is still an integer in a float
const float OPTICAL_DEPTH_BLACK = 12.0 * OPTICAL_DEPTH_STEPS; // optical depth of VISIBILITY_BLACK

vec3 optical_depth_of(vec3 transmittance)
{
#ifdef HAS_TRANSLUCENT
    vec3 optical_depth = min(round(-OPTICAL_DEPTH_STEPS * log2(max(transmittance, vec3(1e-5)))), vec3(OPTICAL_DEPTH_MAX));
    return mix(optical_depth, vec3(0.0), greaterThanEqual(transmittance, vec3(1.0)));
#else
    return OPTICAL_DEPTH_MAX * (1.0 - transmittance); // transmittance is 0 or 1
#endif
}

vec3 transmittance_left(vec3 optical_depth)
{
#ifdef HAS_TRANSLUCENT
    return min_component(optical_depth) >= OPTICAL_DEPTH_BLACK ? vec3(0.0) : exp2(-optical_depth / OPTICAL_DEPTH_STEPS);
#else
    return vec3(optical_depth.x == 0.0 ? 1.0 : 0.0);
#endif
}
