// SPDX-License-Identifier: MIT
// How a surface scatters light: the shares of the light along the view that it reflects, scatters and refracts, and its
// reflectance from a light to the eye.
//
// A dielectric reflects by Fresnel's equations, a metal by Schlick's approximation. A rough surface has no one mirror
// direction, and one ray cannot blur: as the roughness grows, its mirror ray is faded out and what it carried is
// replaced by the irradiance about that direction, and Fresnel's rise at grazing angles is faded out too. What is
// reflected, refracted and scattered never adds up to more than what arrives, be it from all around (struct split) or
// from a light (brdf); tests/accuracy/shading_energy.c holds both to it.
//
// Defines: those of common/material.glsl.

#include "shared/material.h"
#include "common/brdf.glsl"
#include "common/material.glsl"

// Roughness at which the mirror ray begins to fade; at MIRROR_ROUGHNESS_GONE it is gone.
const float MIRROR_ROUGHNESS_SHARP = 0.1;

// How a surface splits the light along the view.
struct split {
    vec3 mirror;      // Fresnel reflectance
    vec3 scattered;   // Lambert's albedo times what is not mirrored
    vec3 refracted;
    float mirror_ray; // share of `mirror` that the mirror ray carries; the rest is blurred
};

split split_light(surface s, float NoV)
{
    bool leaves = s.inside && s.transmission > 0.0;
    // Total reflection does not depend on roughness.
    float dielectric = leaves ? fresnel_rough_dielectric(NoV, 1.0 / s.ior, s.roughness * (1.0 - s.transmission))
                              : fresnel_rough_dielectric(NoV, s.ior, s.roughness);
    vec3 metal = mix(fresnel_schlick(s.base, NoV), s.base, s.roughness);
    split result;
    result.mirror = mix(vec3(dielectric), metal, s.metallic);
    vec3 rest = s.base * ((1.0 - dielectric) * (1.0 - s.metallic));
    result.scattered = rest * (1.0 - s.transmission);
    // Glass is tinted once, where light enters it.
    result.refracted = (leaves ? vec3((1.0 - dielectric) * (1.0 - s.metallic)) : rest) * s.transmission;
    float blurred = smoothstep(MIRROR_ROUGHNESS_SHARP, MIRROR_ROUGHNESS_GONE, s.roughness);
    result.mirror_ray = leaves ? 1.0 : 1.0 - blurred;
    return result;
}

// The mirrored direction; about the geometric normal where the shading normal would send it into the surface.
vec3 mirror_direction(surface s, vec3 direction)
{
    vec3 mirrored = reflect(direction, s.normal);
    return dot(mirrored, s.geometric) > 0.0 ? mirrored : reflect(direction, s.geometric);
}

// Of brdf() what is scattered, not mirrored; NoL > 0.
vec3 brdf_scattered(surface s, split parts, float NoL)
{
    float enters = 1.0 - fresnel_rough_dielectric(NoL, s.ior, s.roughness);
    float enters_mean = 1.0 - fresnel_rough_dielectric_mean(s.ior, s.roughness);
    return parts.scattered * (enters / enters_mean * INVERSE_PI);
}

// Share of the irradiance from a direction (of a light, unit) that goes to the eye, per steradian; without the cosine.
// 0 from below the horizon, and for glass seen from inside, where no light is sampled. Reciprocal. `parts`: of the same
// surface and NoV.
//
// What is mirrored: Cook and Torrance 1982 with GGX. Scattered light passed the boundary twice and is diminished both
// times: Shirley et al. A Practitioners' Assessment of Light Reflection Models. 1997, with our reflectance in the place
// of Schlick's. (1 - F) of the half-way vector alone, as often seen, would give out up to 1.7 of what arrives at
// grazing angles.
vec3 brdf(surface s, split parts, vec3 view, float NoV, vec3 light)
{
    float NoL = dot(s.normal, light);
    if (NoL <= 0.0 || dot(s.geometric, light) <= 0.0)
        return vec3(0.0);
    vec3 half_way = normalize(view + light), across = cross(s.normal, half_way);
    float NoH = clamp(dot(s.normal, half_way), 0.0, 1.0), VoH = clamp(dot(view, half_way), 0.0, 1.0);
    vec3 mirror = mix(vec3(fresnel_dielectric(VoH, s.ior)), fresnel_schlick(s.base, VoH), s.metallic);
    float alpha = square(max(s.roughness, ROUGHNESS_MIN_LIGHT));
    vec3 specular = mirror * (D_GGX(NoH, dot(across, across), alpha) * V_SmithGGXCorrelated(NoV, NoL, alpha));
    return brdf_scattered(s, parts, NoL) + specular;
}
