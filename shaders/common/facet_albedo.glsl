// SPDX-License-Identifier: MIT
// Albedo of rough facets, by the first reflection and by further ones. Kulla, Conty. Revisiting Physically Based Shading
// at Imageworks. 2017: light that a facet mirrors into another one is not lost but leaves the surface after further
// reflections, in all directions.
//
// Polynomials fitted to integrals over the facets of common/facets.glsl, erring on the side that creates no energy. For
// cosines above 0.08 they are off by at most
//
//   lost        -0.007 (of the arriving light)
//   dielectric  +0.006 for an index of 1.1 to 2.4; beyond it -0.025 to +0.005
//   means       those of the functions above within 0.004
//
// `stretched`: the cosine after a stretch of the surface that makes its facets those of a sphere (stretched_cosine()).
//
// Defines: WARD the facets are Ward's, else GGX's.

#include "common/brdf.glsl"

#ifdef WARD
const vec3 LOST_STEEP = vec3(2.0734, -1.7714, -0.18051), LOST_ROUGH = vec3(5.1217, -4.7296, -0.18766);
const vec3 LOST_BY_ALPHA = vec3(0.062194, 1.6859, -0.46562), LOST_BY_COSINE = vec3(9.4351, 2.1407, -0.46698);
const vec3 LOST_BY_SQUARE = vec3(-17.267, -3.1777, 7.379);
const vec3 LOST_MEAN = vec3(7.24555, -29.9358, 74.9076), LOST_MEAN_HIGH = vec3(-107.041, 76.7978, -21.4639);
const vec4 COSINE = vec4(-0.03448, 0.91126, -0.94884, 0.33388);
const vec3 COSINE_SLANTED = vec3(-0.45577, 1.3967, -0.7934), COSINE_UPRIGHT = vec3(1.0647, -2.4818, -0.57614);
const vec2 COSINE_THIN = vec2(0.0011027, 0.051501);
const vec4 DIELECTRIC_MEAN_0 = vec4(0.47617, 0.19987, -1.6742, 1.0919);
const vec4 DIELECTRIC_MEAN_1 = vec4(-0.24995, -0.29905, 3.7436, -2.9506);
const vec4 DIELECTRIC_MEAN_2 = vec4(0.75287, 0.31288, -3.3897, 2.4337);
#else
const vec3 LOST_STEEP = vec3(0.40305, 1.5574, 6.0782), LOST_ROUGH = vec3(25.006, -25.018, 25.228);
const vec3 LOST_BY_ALPHA = vec3(37.659, -40.0, 17.258), LOST_BY_COSINE = vec3(16.892, 7.2871, 52.172);
const vec3 LOST_BY_SQUARE = vec3(-17.87, -41.036, 2.9991);
const vec3 LOST_MEAN = vec3(7.10373, -34.7614, 102.014), LOST_MEAN_HIGH = vec3(-157.964, 117.994, -33.7981);
const vec4 COSINE = vec4(0.22006, 1.4051, -1.9258, 0.78696);
const vec3 COSINE_SLANTED = vec3(-0.36497, 0.89908, -0.85462), COSINE_UPRIGHT = vec3(0.17768, -2.0083, -0.067157);
const vec2 COSINE_THIN = vec2(0.021065, 0.12727);
const vec4 DIELECTRIC_MEAN_0 = vec4(0.48784, 0.090275, -1.977, 1.4514);
const vec4 DIELECTRIC_MEAN_1 = vec4(-0.28918, -0.045717, 4.5876, -3.99);
const vec4 DIELECTRIC_MEAN_2 = vec4(0.77645, 0.23142, -4.0046, 3.0548);
#endif

float stretched_cosine(float cosine, float alpha)
{
    return cosine * inversesqrt(mix(square(alpha), 1.0, square(cosine)));
}

// Share of the light from a direction that fully reflecting facets send into other facets.
float facets_lost(float stretched, float alpha)
{
    float s = stretched, s2 = s * s, a2 = alpha * alpha;
    float share = (1.0 - s2) * dot(LOST_STEEP, vec3(1.0, s, alpha)) + a2 * dot(LOST_ROUGH, vec3(1.0, s, alpha));
    float by_alpha = dot(LOST_BY_ALPHA, vec3(alpha, a2, a2 * alpha));
    float by_cosine = dot(LOST_BY_COSINE, vec3(1.0, alpha, a2)) * s + dot(LOST_BY_SQUARE, vec3(1.0, alpha, s)) * s2;
    return max(s * share / (1.0 + by_alpha + by_cosine), 0.0);
}

// Mean of facets_lost() over the hemisphere, cosine-weighted.
float facets_lost_mean(float alpha)
{
    float r = sqrt(alpha), r3 = r * alpha;
    vec3 powers = vec3(1.0, r, alpha);
    return alpha * alpha * (dot(LOST_MEAN, powers) + r3 * dot(LOST_MEAN_HIGH, powers));
}

// Cosine to the facet at which its reflectance is the mean over the facets that are seen and lit.
float facets_cosine(float cosine, float alpha)
{
    float r = sqrt(alpha), x = cosine / (cosine + alpha);
    float upright = dot(COSINE_SLANTED, vec3(1.0, r, alpha)) + x * dot(COSINE_UPRIGHT, vec3(1.0, r, x));
    return cosine + r * (dot(COSINE, vec4(1.0, r, alpha, alpha * r)) + x * upright);
}

// Cosine at which a dielectric's curve has the mean over the facets that are seen and lit. `mean`: facets_cosine().
float facets_dielectric_cosine(float mean, float alpha, float ior)
{
    // Where Fresnel's curve bends the most, facets at the horizon count for more than the mean one.
    float r = sqrt(alpha), s = (ior - 1.0) / (ior + 1.0);
    float bent = max(1.0 / (s + 0.04) - 1.0 / 0.24, 0.0) * (COSINE_THIN.x + COSINE_THIN.y * r) + max(s - 0.29, 0.0) *
                 square(1.0 - mean);
    return clamp(mean * max(1.0 - bent * r * square(1.0 - mean), 0.1), 1e-4, 1.0);
}

// Share that facets of a dielectric mirror at the first reflection.
float facets_dielectric(float mean, float lost, float alpha, float ior)
{
    return (1.0 - lost) * fresnel_dielectric(facets_dielectric_cosine(mean, alpha, ior), ior);
}

float facets_dielectric_mean(float alpha, float ior)
{
    float s = (ior - 1.0) / (ior + 1.0), r = sqrt(alpha);
    vec4 powers = vec4(1.0, r, alpha, alpha * r);
    float steeper = dot(DIELECTRIC_MEAN_1, powers) + s * dot(DIELECTRIC_MEAN_2, powers);
    return s * (dot(DIELECTRIC_MEAN_0, powers) + s * steeper);
}

// Colour of a metal's multiple reflections, as a share of facets_lost(): its mean reflectance for each facet, some of
// which send the light out and the others on to further facets. Hill. A Multi-Faceted Exploration. 2018.
vec3 metal_again(vec3 mean, float lost_mean)
{
    return mean * mean * (1.0 - lost_mean) / (1.0 - mean * lost_mean);
}
