// SPDX-License-Identifier: MIT
// Answers of shadow rays (shared/ray.h).
#include "shared/ray.h"

uint visibility_of(vec3 transmittance)
{
    uvec3 steps = uvec3(pow(transmittance, vec3(1.0 / 3.0)) * float(VISIBILITY_MAX) + 0.5);
    uint light = steps.r | steps.g << VISIBILITY_BITS | steps.b << 2u * VISIBILITY_BITS;
    return light != 0u ? light | ~VISIBILITY_LIT : 0u;
}

vec3 transmittance_of(uint visibility)
{
    uvec3 steps = uvec3(visibility, visibility >> VISIBILITY_BITS, visibility >> 2u * VISIBILITY_BITS) & VISIBILITY_MAX;
    vec3 root = vec3(steps) / float(VISIBILITY_MAX);
    return root * root * root;
}
