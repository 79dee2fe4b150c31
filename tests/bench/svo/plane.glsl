// SPDX-License-Identifier: MIT
// A leaf's plane in 32 bits (svo/svo.h).
#include "common/unit.glsl"
#include "svo/svo.h"

const float PLANE_MAX = float((1 << (SVO_PLANE_BITS - 1)) - 1);
const int PLANE_FAR = 511; // units; -512 is SVO_NO_PLANE's

uint pack_plane(vec3 normal, float distance_cells)
{
    ivec2 flat_ = ivec2(round(octahedral_from_unit(normal) * PLANE_MAX));
    int units = clamp(int(round(distance_cells / SVO_PLANE_UNIT)), -PLANE_FAR, PLANE_FAR);
    return uint(flat_.x & 2047) | uint(flat_.y & 2047) << 11 | uint(units) << 22;
}

vec4 unpack_plane(uint bits)
{
    vec2 flat_ = vec2(bitfieldExtract(int(bits), 0, 11), bitfieldExtract(int(bits), 11, 11)) / PLANE_MAX;
    return vec4(unit_from_octahedral(flat_), float(int(bits) >> 22) * SVO_PLANE_UNIT);
}
