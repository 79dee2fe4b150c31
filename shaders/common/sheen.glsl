// SPDX-License-Identifier: MIT
// Upright fibres of cloth: Estevez, Kulla. Production Friendly Microfacet Sheen BRDF. 2017, in the form of
// KHR_materials_sheen. They dim the surface beneath on the way in and on the way out, so the sum is reciprocal and never
// exceeds the arriving light; a white surface keeps 0.98 to 1 of it.
//
// Defines: HAS_SHEEN some material has fibres.

#include "common/math.glsl"

#ifdef HAS_SHEEN

// Minimum alpha: more upright fibres would reflect more than the arriving light at the horizon.
const float SHEEN_ALPHA_MIN = 0.035;

float sheen_alpha(float roughness)
{
    return max(square(roughness), SHEEN_ALPHA_MIN);
}

float sheen_lambda_of(float x, float alpha)
{
    float rough = square(1.0 - alpha);
    float a = mix(21.5473, 25.3245, rough), b = mix(3.82987, 3.32435, rough), c = mix(0.19823, 0.16801, rough);
    return a / (1.0 + b * pow(x, c)) + mix(-1.97760, -1.27393, rough) * x + mix(-4.32054, -4.85967, rough);
}

// Masking of fibres by other fibres from a direction, section 3.
float sheen_lambda(float cosine, float alpha)
{
    if (cosine < 0.5)
        return exp(sheen_lambda_of(cosine, alpha));
    return exp(2.0 * sheen_lambda_of(0.5, alpha) - sheen_lambda_of(1.0 - cosine, alpha));
}

// Reflectance of white fibres, per steradian. The second factor is at most 1, as in Khronos' sample viewer.
float sheen_reflectance(float roughness, float NoH, float NoV, float NoL)
{
    float alpha = sheen_alpha(roughness), sine_squared = max(1.0 - square(NoH), 1e-6);
    float density = (2.0 + 1.0 / alpha) * pow(sine_squared, 0.5 / alpha) / TWO_PI;
    float seen = 1.0 + sheen_lambda(NoV, alpha) + sheen_lambda(NoL, alpha);
    return density * min(1.0 / (seen * 4.0 * max(NoV * NoL, 1e-7)), 1.0);
}

// Powers of the roughness for the fits below.
vec4 sheen_powers(float roughness)
{
    float r = max(roughness, sqrt(SHEEN_ALPHA_MIN));
    return vec4(1.0, r, r * r, r * r * r);
}

// Share of the light from all around that white fibres reflect along a direction: fitted to the integral of the function
// above, -0.005 to +0.017 off.
float sheen_albedo(float cosine, float roughness)
{
    vec4 r = sheen_powers(roughness);
    float s = sqrt(cosine), s2 = s * s;
    float low = dot(vec4(0.7205, -5.7871, 8.8814, -4.1805), r) + s * dot(vec4(1.5439, 5.1001, -11.209, 6.116), r);
    float middle = dot(vec4(-20.6378, 22.1018, -2.6931, -6.0213), r) +
                   s * dot(vec4(18.5621, 9.7948, -57.0766, 36.8519), r);
    float high = dot(vec4(-12.5476, -1.1001, 31.8204, -22.0534), r);
    return min(exp(low + s2 * (middle + s2 * high)), 1.0);
}

// Mean of sheen_albedo() over the hemisphere, cosine-weighted, within 0.002.
float sheen_albedo_mean(float roughness)
{
    vec4 r = sheen_powers(roughness);
    return dot(vec4(0.100214, -0.681893, 2.656255, -2.653113), r) + 0.883968 * r.z * r.z;
}

#endif
