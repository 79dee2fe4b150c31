// SPDX-License-Identifier: MIT
// Limits light that one path in thousands finds, which causes most noise: `clamp` of the protocol's render.
//
//   limited                light over a rough surface and at least one more is scaled down to a limit. Light that a
//                          single rough surface scatters to the eye, or to smooth mirrors and windows before it, stays
//                          whole
//   regularised_roughness  surfaces behind a rough one are no sharper: Kaplanyan, Dachsbacher. Path Space Regularization
//                          for Holistic and Robust Light Transport. 2013. Angles shrink as the sixth root of the number
//                          of samples, so that noise and bias both vanish

#include "shared/path.h"
#include "common/math.glsl"

uniform float radiance_limit; // 0: no limit, and nothing is regularised

// Flags of a path that a surface of that roughness has sent on.
uint path_sent_on(uint flags, float roughness)
{
    uint step_ = uint(clamp(roughness / PATH_STEPS_ROUGHNESS, 0.0, 1.0) * PATH_STEPS) << PATH_STEP_SHIFT;
    return flags & ~PATH_STEP_MASK | max(flags & PATH_STEP_MASK, step_);
}

// Roughness for sample `index`: angles go as its square.
float shrunk_roughness(float roughness, uint index)
{
    return roughness * pow(float(index + 1u), -1.0 / 12.0);
}

float regularised_roughness(path p, float roughness, uint index)
{
    float step_ = float((p.flags & PATH_STEP_MASK) >> PATH_STEP_SHIFT) * (PATH_STEPS_ROUGHNESS / PATH_STEPS);
    return radiance_limit > 0.0 ? max(roughness, shrunk_roughness(step_, index)) : roughness;
}

// Limits light, except on paths with at most `bounces`: 1 for light that the ray has hit, 0 for light that its hit
// samples.
vec3 limited(path p, uint bounces, vec3 arriving)
{
    float size = max_component(arriving);
    bool bound = radiance_limit > 0.0 && (p.flags & PATH_STEP_MASK) != 0u && (p.flags & PATH_BOUNCES_MASK) > bounces;
    return bound && size > radiance_limit ? arriving * (radiance_limit / size) : arriving;
}
