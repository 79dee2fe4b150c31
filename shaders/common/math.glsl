// SPDX-License-Identifier: MIT
// Constants, unit vectors in 32 bits, 3x4 transforms, ray origins that clear their surface.

const float PI = 3.14159265358979;
const float TWO_PI = 6.28318530717959;
const float INVERSE_PI = 0.318309886183791;

float square(float x)
{
    return x * x;
}

// a / b of whole numbers below 2^24. Software GL divides whole numbers one by one, and floats side by side: rounding can
// take the quotient to the next number.
uint quotient(uint a, uint b)
{
    uint q = uint(float(a) / float(b));
    int rest = int(a - q * b);
    return rest < 0 ? q - 1u : rest >= int(b) ? q + 1u : q;
}

// atan(y, x), and 0 if both are 0: GLSL leaves this undefined, and some drivers return NaN.
float azimuth(float y, float x)
{
    return x == 0.0 && y == 0.0 ? 0.0 : atan(y, x);
}

float max_component(vec3 v)
{
    return max(v.x, max(v.y, v.z));
}

float min_component(vec3 v)
{
    return min(v.x, min(v.y, v.z));
}

// 1 for zero too: an octahedron's seam must not fold to nothing.
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

// 2 x 16 bit snorm: exact to 0.003 degrees.
uint pack_unit(vec3 unit)
{
    return packSnorm2x16(octahedral_from_unit(unit));
}

vec3 unpack_unit(uint bits)
{
    return unit_from_octahedral(unpackSnorm2x16(bits));
}

// 2 x 12 bit snorm, in bits 0..23: exact to 0.05 degrees.
uint pack_unit_24(vec3 unit)
{
    ivec2 p = ivec2(round(octahedral_from_unit(unit) * 2047.0));
    return uint(p.x) & 0xfffu | (uint(p.y) & 0xfffu) << 12;
}

vec3 unpack_unit_24(uint bits)
{
    return unit_from_octahedral(vec2(bitfieldExtract(int(bits), 0, 12), bitfieldExtract(int(bits), 12, 12)) / 2047.0);
}

// struct hit's tangent: x 16 bits, y 15 bits, lowest bit set where the handedness is negative.
// packSnorm2x16 puts y in the upper half; here x is the upper half and y's lowest bit is free.
uint pack_tangent(vec3 unit, float handedness)
{
    uint bits = packSnorm2x16(octahedral_from_unit(unit).yx);
    return (bits & ~1u) | (handedness < 0.0 ? 1u : 0u);
}

vec4 unpack_tangent(uint bits)
{
    return vec4(unit_from_octahedral(unpackSnorm2x16(bits & ~1u).yx), (bits & 1u) != 0u ? -1.0 : 1.0);
}

// Rows of a 3x4 matrix times a point, a vector; and the transposed upper 3x3 times a covector: with the rows
// of object_from_world this takes an object-space normal to world space, also where the scale is uneven. `precise`: all
// programs find the same place, and what one of them counts or hits there, another one draws or shades.
vec3 affine_point(vec4 rows[3], vec3 point)
{
    vec4 p = vec4(point, 1.0);
    precise vec3 moved = vec3(dot(rows[0], p), dot(rows[1], p), dot(rows[2], p));
    return moved;
}

vec3 affine_vector(vec4 rows[3], vec3 vector)
{
    precise vec3 turned = vec3(dot(rows[0].xyz, vector), dot(rows[1].xyz, vector), dot(rows[2].xyz, vector));
    return turned;
}

vec3 affine_covector(vec4 rows[3], vec3 covector)
{
    precise vec3 turned = rows[0].xyz * covector.x + rows[1].xyz * covector.y + rows[2].xyz * covector.z;
    return turned;
}

// Two unit vectors across a unit normal.
// Duff et al., Building an Orthonormal Basis, Revisited, JCGT 2017.
void tangent_frame(vec3 normal, out vec3 tangent, out vec3 bitangent)
{
    float s = normal.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + normal.z);
    float b = normal.x * normal.y * a;
    tangent = vec3(1.0 + s * normal.x * normal.x * a, s * b, -s * normal.x);
    bitangent = vec3(b, s + normal.y * normal.y * a, -normal.y);
}

// Axes x y z as the image that looks along one of them has them: u v depth.
vec3 in_image(vec3 p, int axis)
{
    return axis == 0 ? p.yzx : axis == 1 ? p.zxy : p;
}

// Moves a point off its surface, to the side the unit normal points to, by about the uncertainty of its coordinates:
// steps in the last places far from the origin, a fixed distance near it. Waechter and Binder, A Fast and Robust Method
// for Avoiding Self-Intersection, Ray Tracing Gems, chapter 6.
vec3 offset_ray_origin(vec3 point, vec3 normal)
{
    const float near_origin = 1.0 / 32.0;
    const float float_scale = 1.0 / 65536.0;
    const float int_scale = 256.0;
    ivec3 steps = ivec3(int_scale * normal);
    vec3 moved = intBitsToFloat(floatBitsToInt(point) + mix(steps, -steps, lessThan(point, vec3(0.0))));
    return mix(moved, point + float_scale * normal, lessThan(abs(point), vec3(near_origin)));
}

// Whether a share of the cases is meant, by a number that comes back stretched to [0, 1) again.
bool is_in(float share, inout float number)
{
    bool in_ = number < share;
    number = min(in_ ? number / share : (number - share) / (1.0 - share), 0.99999994);
    return in_;
}
