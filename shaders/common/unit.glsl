// SPDX-License-Identifier: MIT
// Unit vectors in 32 bits and less.

// Sign of a number, 1 for zero too: an octahedron's seam must not collapse.
vec2 sign_not_zero(vec2 v)
{
    return vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0);
}

// A direction on the unit octahedron, unfolded to the square -1..1.
// Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors, JCGT 2014.
vec2 octahedral_from_unit(vec3 unit)
{
    vec2 p = unit.xy / (abs(unit.x) + abs(unit.y) + abs(unit.z));
    return unit.z >= 0.0 ? p : (1.0 - abs(p.yx)) * sign_not_zero(p);
}

vec3 unit_from_octahedral(vec2 p)
{
    vec3 v = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (v.z < 0.0)
        v.xy = (1.0 - abs(v.yx)) * sign_not_zero(v.xy);
    return normalize(v);
}

// Packs 2 x 16 bit snorm: exact to 0.003 degrees.
uint pack_unit(vec3 unit)
{
    return packSnorm2x16(octahedral_from_unit(unit));
}

vec3 unpack_unit(uint bits)
{
    return unit_from_octahedral(unpackSnorm2x16(bits));
}

// Packs 2 x 12 bit snorm, in bits 0..23: exact to 0.05 degrees.
uint pack_unit_24(vec3 unit)
{
    ivec2 p = ivec2(round(octahedral_from_unit(unit) * 2047.0));
    return uint(p.x) & 0xfffu | (uint(p.y) & 0xfffu) << 12;
}

// Packs struct hit's tangent: x 16 bits, y 15 bits, lowest bit set where the handedness is negative. packSnorm2x16 puts y
// in the upper half; here x is the upper half and y's lowest bit is free.
uint pack_tangent(vec3 unit, float handedness)
{
    uint bits = packSnorm2x16(octahedral_from_unit(unit).yx);
    return (bits & ~1u) | (handedness < 0.0 ? 1u : 0u);
}

vec4 unpack_tangent(uint bits)
{
    return vec4(unit_from_octahedral(unpackSnorm2x16(bits & ~1u).yx), (bits & 1u) != 0u ? -1.0 : 1.0);
}
