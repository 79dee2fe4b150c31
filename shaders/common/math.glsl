// SPDX-License-Identifier: MIT
// Constants, and small functions of numbers and vectors. Software GL also compiles functions that no program calls, so
// common/unit.glsl and common/affine.glsl have those that few programs need.

const float PI = 3.14159265358979;
const float TWO_PI = 6.28318530717959;
const float INVERSE_PI = 0.318309886183791;

float square(float x)
{
    return x * x;
}

// Quotient of integers below 2^24. Software GL divides integers one by one, and floats side by side: rounding may give
// the next number.
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

// Permutes axes x y z to those of the image that looks along `axis`: u v depth.
vec3 in_image(vec3 p, int axis)
{
    return axis == 0 ? p.yzx : axis == 1 ? p.zxy : p;
}

// Decides with probability `share`; `number` decides, and is stretched to [0, 1) again.
bool is_in(float share, inout float number)
{
    bool in_ = number < share;
    number = min(in_ ? number / share : (number - share) / (1.0 - share), 0.99999994);
    return in_;
}
