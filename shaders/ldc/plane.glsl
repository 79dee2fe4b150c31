// SPDX-License-Identifier: MIT
// Plane of a sample and its extent.
#include "ldc/layout.h"
#include "common/math.glsl"

// Direction in ratios: not normalised.
vec3 direction_from_octahedral(uint bits)
{
    vec2 p = unpackSnorm2x16(bits);
    vec3 v = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    vec2 folded = (1.0 - abs(v.yx)) * vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0);
    v.xy = v.z < 0.0 ? folded : v.xy;
    return v;
}

// Deviation of the plane of a sample in an axis's image from the sample's depth.
float plane_reach(uint normal_bits, int axis)
{
    vec3 normal = abs(in_image(direction_from_octahedral(normal_bits), axis));
    float reach = (0.5 + LDC_SLACK) * (normal.x + normal.y) / normal.z;
    return (reach < LDC_SPAN ? reach : LDC_SPAN) + LDC_ROUNDING;
}
