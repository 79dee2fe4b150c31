// SPDX-License-Identifier: MIT
// Bounds of a pixel's radiance.

// Maximum radiance of a pixel: half floats hold 65504, and brighter values are white at any exposure of a scene lit for
// the eye. NaN must not spread either.
const float RADIANCE_MAX = 1e9;

vec4 finite(vec4 v)
{
    return mix(clamp(v, vec4(0.0), vec4(RADIANCE_MAX)), vec4(0.0), isnan(v));
}
