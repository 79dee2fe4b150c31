// SPDX-License-Identifier: MIT
// Reflectances. Cosines are of angles to the normal and positive; NoH and the like are the literature's.

#include "common/math.glsl"

// A light has no extent in a perfect mirror, so its highlight is given that of this perceptual roughness at
// least: a point a pixel or two wide instead of one that no ray ever meets.
const float ROUGHNESS_MIN_LIGHT = 0.08;

// Share that a smooth boundary reflects, unpolarised; eta = index behind / index before. 1 at total internal
// reflection. Fresnel's equations as in Pharr, Jakob, Humphreys. Physically Based Rendering. 9.5.
float fresnel_dielectric(float cos_i, float eta)
{
    float sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
    if (sin2_t >= 1.0)
        return 1.0;
    float cos_t = sqrt(1.0 - sin2_t);
    float parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    float perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

// Schlick. An Inexpensive BRDF Model for Physically-Based Rendering. 1994. What reflects less than any dielectric
// (2 %) loses its grazing reflection with it, as in Lagarde, de Rousiers. Moving Frostbite to PBR. 2014: so an
// index of refraction of 1 is a Lambert surface and nothing else.
vec3 fresnel_schlick(vec3 f0, float cos_i)
{
    float m = clamp(1.0 - cos_i, 0.0, 1.0), m2 = m * m;
    float f90 = clamp(50.0 * greatest(f0), 0.0, 1.0);
    return f0 + (f90 - f0) * (m2 * m2 * m);
}

// Walter et al. Microfacet Models for Refraction through Rough Surfaces. 2007. Equation 33.
float D_GGX(float NoH, float alpha)
{
    float a2 = alpha * alpha;
    float d = NoH * NoH * (a2 - 1.0) + 1.0;
    return a2 / (PI * d * d);
}

// Heitz. Understanding the Masking-Shadowing Function. 2014: height-correlated Smith, divided by 4 NoV NoL.
float V_SmithGGXCorrelated(float NoV, float NoL, float alpha)
{
    float a2 = alpha * alpha;
    float v = NoL * sqrt(NoV * NoV * (1.0 - a2) + a2);
    float l = NoV * sqrt(NoL * NoL * (1.0 - a2) + a2);
    return 0.5 / max(v + l, 1e-7); // both cosines 0: nothing is seen, and not 0/0
}
