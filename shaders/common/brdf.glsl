// SPDX-License-Identifier: MIT
// Reflectances. Cosines are of angles to the normal and positive; NoH and the like are the literature's.

#include "common/math.glsl"

// A light has no extent in a perfect mirror, so its highlight is widened to this perceptual roughness: a point of a pixel
// or two that rays can hit.
const float ROUGHNESS_MIN_LIGHT = 0.08;

// Reflectance of a smooth boundary, unpolarised; eta = index behind / index before. 1 at total internal reflection, 0
// where eta is 1. Fresnel's equations in the form of Cook and Torrance. A Reflectance Model for Computer Graphics. 1982,
// which does not divide by the cosine of the bent ray.
float fresnel_dielectric(float cos_i, float eta)
{
    float g2 = (eta - 1.0) * (eta + 1.0) + cos_i * cos_i;
    if (g2 < 0.0)
        return 1.0;
    float g = sqrt(g2), perpendicular = (g - cos_i) / (g + cos_i);
    float parallel = perpendicular * ((cos_i * (g + cos_i) - 1.0) / (cos_i * (g - cos_i) + 1.0));
    return 0.5 * (perpendicular * perpendicular + parallel * parallel);
}

float schlick_grazing(vec3 f0)
{
    return clamp(50.0 * max_component(f0), 0.0, 1.0);
}

// Schlick. An Inexpensive BRDF Model for Physically-Based Rendering. 1994; for metals. A surface that reflects less than
// any metal (2 %) loses its grazing reflection too, as in Lagarde, de Rousiers. Moving Frostbite to PBR. 2014: so black
// stays black.
vec3 fresnel_schlick(vec3 f0, float cos_i)
{
    float m = clamp(1.0 - cos_i, 0.0, 1.0), m2 = m * m;
    return f0 + (schlick_grazing(f0) - f0) * (m2 * m2 * m);
}

// Mean of fresnel_schlick() over the hemisphere, cosine-weighted.
vec3 fresnel_schlick_mean(vec3 f0)
{
    return f0 + (schlick_grazing(f0) - f0) / 21.0;
}

// Walter et al. Microfacet Models for Refraction through Rough Surfaces. 2007. Equation 33. `sin2_NoH`: squared
// sine between normal and half-way vector, by a cross product: 1 - NoH^2 loses all its digits in a narrow highlight.
float D_GGX(float NoH, float sin2_NoH, float alpha)
{
    float a2 = alpha * alpha;
    float d = NoH * NoH * a2 + sin2_NoH;
    return a2 / (PI * d * d);
}

// Heitz. Understanding the Masking-Shadowing Function. 2014: height-correlated Smith, divided by 4 NoV NoL.
float V_SmithGGXCorrelated(float NoV, float NoL, float alpha)
{
    float a2 = alpha * alpha;
    float v = NoL * sqrt(NoV * NoV * (1.0 - a2) + a2);
    float l = NoV * sqrt(NoL * NoL * (1.0 - a2) + a2);
    return 0.5 / max(v + l, 1e-7); // 0 and not 0/0 where both cosines are 0
}
