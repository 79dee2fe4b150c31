// SPDX-License-Identifier: MIT
// Facets of a surface, which may be stretched along a grain (KHR_materials_anisotropy), and their albedo by the
// polynomials of common/facet_albedo.glsl, which know no grain.
//
// Defines: those of common/material.glsl.

#include "common/brdf.glsl"
#include "common/facet_albedo.glsl"
#include "common/facets.glsl"
#include "common/material.glsl"

// KHR_materials_anisotropy: facets are as rough as the material says across the grain, and up to fully rough along it.
vec2 facet_alpha(surface s, float roughness)
{
#ifdef HAS_ANISOTROPY
    float across = square(roughness);
    return vec2(mix(across, 1.0, square(s.grain.z)), across);
#else
    return vec2(square(roughness));
#endif
}

// Roughness for polynomials that know only one, and a factor on the loss that they give. Fitted so that a white metal, of
// any roughness and grain, keeps 0.974 to 1.000 of the light from all around, and at no angle more than 1.005.
vec2 facet_alpha_mean(vec2 alpha)
{
#ifdef HAS_ANISOTROPY
    float mean = 0.5 * (alpha.x + alpha.y), squares = sqrt(0.5 * dot(alpha, alpha));
    float uneven = 1.0 - alpha.y / max(alpha.x, FACET_ALPHA_MIN);
#ifdef WARD
    vec2 more = vec2(0.2 * uneven * square(uneven), -0.1 * uneven);
#else
    vec2 more = vec2(0.2 * square(uneven), -0.08 * uneven);
#endif
    return vec2(min(0.5 * (mean + squares) * (1.0 + more.x), 1.0), 1.0 + more.y);
#else
    return vec2(alpha.x, 1.0);
#endif
}

float facets_alpha(surface s)
{
    return facet_alpha_mean(facet_alpha(s, s.roughness)).x;
}

// Roughness of a surface without a grain that blurs as much.
float blurring_roughness(surface s)
{
#ifdef HAS_ANISOTROPY
    return sqrt(facets_alpha(s));
#else
    return s.roughness;
#endif
}

// Whether the facets are rough enough to differ from the surface itself.
bool facets_are_rough(surface s)
{
    return facet_alpha(s, s.roughness).x > FACET_ALPHA_MIN;
}

// Roughness of rough facets for sampling one of them, along and across the grain.
vec2 sampled_alpha(surface s)
{
    return max(facet_alpha(s, s.roughness), FACET_ALPHA_MIN);
}

// Unit vectors across the normal: the first one along the grain, an arbitrary one if there is none.
void facet_axes(surface s, out vec3 x, out vec3 y)
{
#ifdef HAS_ANISOTROPY
    x = s.along;
    y = cross(s.normal, x);
#else
    tangent_frame(s.normal, x, y);
#endif
}

// facets_lost() of a direction; the facets are seen at `cosine`, positive.
float facets_lost_from(surface s, vec3 direction, float cosine)
{
#ifdef HAS_ANISOTROPY
    vec2 alpha = facet_alpha(s, s.roughness), mean = facet_alpha_mean(alpha);
    vec3 x, y;
    facet_axes(s, x, y);
    vec3 local = vec3(dot(direction, x), dot(direction, y), cosine);
    return mean.y * facets_lost(facet_stretched(local, alpha), mean.x);
#else
    float alpha = square(s.roughness);
    return facets_lost(stretched_cosine(cosine, alpha), alpha);
#endif
}

// Reflection of fully reflecting facets of this roughness from a light to the eye, per steradian and without the cosine:
// Cook and Torrance 1982, without Fresnel's factor.
float facets_mirror(surface s, float roughness, vec3 view, float NoV, vec3 light, float NoL)
{
    vec3 half_way = normalize(view + light);
#ifdef HAS_ANISOTROPY
    vec2 alpha = facet_alpha(s, roughness);
    vec3 x, y;
    facet_axes(s, x, y);
    float seen = length(vec3(alpha * vec2(dot(view, x), dot(view, y)), NoV));
    float lit = length(vec3(alpha * vec2(dot(light, x), dot(light, y)), NoL));
    float density = facet_density_ggx(vec3(dot(half_way, x), dot(half_way, y), dot(half_way, s.normal)), alpha);
    return density * (0.5 / max(NoL * seen + NoV * lit, 1e-7)); // in the form of V_SmithGGXCorrelated()
#else
    vec3 across = cross(s.normal, half_way);
    float NoH = clamp(dot(s.normal, half_way), 0.0, 1.0), alpha = square(roughness);
    return D_GGX(NoH, dot(across, across), alpha) * V_SmithGGXCorrelated(NoV, NoL, alpha);
#endif
}
