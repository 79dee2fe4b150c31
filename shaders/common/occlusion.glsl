// SPDX-License-Identifier: MIT
// Ambient occlusion rays. Their mean is the cosine-weighted share of unobstructed directions above a surface.
//
// A ray's length is random like its direction: with u uniform, reach * (1 - u^(1 / falloff)) exceeds t with probability
// (1 - t / reach)^falloff. So an occluder at t has this weight in the mean, though each ray only reports whether it
// hits anything.

#include "common/math.glsl"

// Direction of a ray, cosine-weighted about the shading normal; directions below the surface itself are mirrored at it.
// `u`: two numbers in [0, 1). `geometric`, `normal`: unit, on one side.
vec3 occlusion_direction(vec3 geometric, vec3 normal, vec2 u)
{
    vec3 x, y;
    tangent_frame(normal, x, y);
    float sine = sqrt(u.x), phi = TWO_PI * u.y;
    vec3 direction = sine * (cos(phi) * x + sin(phi) * y) + sqrt(1.0 - u.x) * normal;
    float below = min(dot(direction, geometric), 0.0);
    return normalize(direction - 2.0 * below * geometric);
}

float occlusion_reach(float reach, float falloff, float u)
{
    return falloff > 0.0 ? reach * (1.0 - pow(u, 1.0 / falloff)) : reach;
}
