// SPDX-License-Identifier: MIT
// Defines: HAS_TRANSLUCENT some material lets shadow rays pass.
#include "common/math.glsl"

// The optical depth of a shadow ray so far, per channel: -log2 of the transmittance in steps of 2^-19, as whole numbers
// in floats. Their sums are exact, so the answer does not depend on the order of the surfaces, as a product of floats
// would.
const float OPTICAL_DEPTH_STEPS = 524288.0;
const float OPTICAL_DEPTH_MAX = 8388607.0;   // the maximum: twice as much is still a whole number in a float
const float OPTICAL_DEPTH_BLACK = 12.0 * OPTICAL_DEPTH_STEPS; // of VISIBILITY_BLACK

vec3 optical_depth_of(vec3 transmittance)
{
#ifdef HAS_TRANSLUCENT
    vec3 optical_depth = min(round(-OPTICAL_DEPTH_STEPS * log2(max(transmittance, vec3(1e-5)))), vec3(OPTICAL_DEPTH_MAX));
    return mix(optical_depth, vec3(0.0), greaterThanEqual(transmittance, vec3(1.0)));
#else
    return OPTICAL_DEPTH_MAX * (1.0 - transmittance); // 0 or 1
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
