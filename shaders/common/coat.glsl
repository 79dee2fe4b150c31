// SPDX-License-Identifier: MIT
// A clear varnish over a surface: KHR_materials_clearcoat. GGX facets with a roughness and a normal of their own, each a
// smooth mirror by Fresnel's equations. Light that they do not mirror reaches the surface below; its reflection leaves
// with the same loss.
//
// The coat mirrors E(V) of the light along the view, so T = 1 - E passes. Light scattered below appears as
//
//   T(V) T(L) / T~             T~ the mean of T(L): the sum is T(V) times the light that the surface scatters, and it is
//                              reciprocal (Kelemen, Szirmay-Kalos. A Microfacet Based Coupled Specular-Matte BRDF Model.
//                              2001)
//
// and light mirrored below as the greater one of
//
//   min(T(V), T(L))            exact where L is V's mirrored direction
//   T(V) T(L) / T_upright      where facets below are so rough that few L are near it; T_upright: the mean seen from above
//
// which in a furnace, of white metal, leaves 0.957 to 1.01 at every angle and roughness, and 0.98 to 1 on average
// (integrals over the facets of common/facets.glsl). No light is lost within the coat.
//
// From inside of glass there is no coat: both would have the same index.
//
// Defines: HAS_CLEARCOAT some surface is varnished; without it these functions are 0 and 1.

#include "common/brdf.glsl"
#include "common/facet_albedo.glsl"
#include "common/material.glsl"

// Index of refraction in KHR_materials_clearcoat.
const float COAT_IOR = 1.5;

// Shares of light along the view at a coat.
struct coating {
#ifdef HAS_CLEARCOAT
    float mirrors;                  // E(V)
    float scattered_mean, upright_; // T~, T_upright
#endif
    float passes;                   // T(V)
};

#ifdef HAS_CLEARCOAT
float coat_cosine(surface s, vec3 direction)
{
    return clamp(dot(s.coat_normal, direction), 1e-4, 1.0); // a shading normal may lean away
}

float coat_mirrors(surface s, float cosine)
{
    float alpha = square(s.coat_roughness);
    float lost = facets_lost(stretched_cosine(cosine, alpha), alpha);
    return s.coat * facets_dielectric(facets_cosine(cosine, alpha), lost, alpha, COAT_IOR);
}
#endif

coating coating_of(surface s, vec3 view)
{
    coating c;
    c.passes = 1.0;
#ifdef HAS_CLEARCOAT
    c.mirrors = in_glass(s) ? 0.0 : coat_mirrors(s, coat_cosine(s, view));
    c.passes = 1.0 - c.mirrors;
    float mean = facets_dielectric_mean(square(s.coat_roughness), COAT_IOR), alpha = square(s.roughness);
    // Light enters a dielectric mostly away from the horizon, as light that passes the coat does: the mean is 0.88 of the
    // plain one.
    c.scattered_mean = 1.0 - 0.88 * s.coat * mean;
    // Share of the light mirrored upwards by facets that comes from all around; it grows with their roughness.
    float around = 1.2 * square(alpha) / (square(alpha) + 0.2);
    c.upright_ = 1.0 - mix(coat_mirrors(s, 1.0), 1.15 * s.coat * mean, around);
#endif
    return c;
}

// Share of the light from a direction that passes the coat, is scattered below and comes back to the view; divided by the
// share along the view, which `split` has.
float coat_over_scattered(coating c, surface s, vec3 light)
{
#ifdef HAS_CLEARCOAT
    return (1.0 - coat_mirrors(s, coat_cosine(s, light))) / c.scattered_mean;
#else
    return 1.0;
#endif
}

// Share of the light from a direction that the surface below mirrors to the view, through the coat both ways.
float coat_over_mirrored(coating c, surface s, vec3 light)
{
#ifdef HAS_CLEARCOAT
    float from = 1.0 - coat_mirrors(s, coat_cosine(s, light));
    return c.mirrors > 0.0 ? max(min(c.passes, from), c.passes * from / c.upright_) : 1.0;
#else
    return 1.0;
#endif
}

#ifdef HAS_CLEARCOAT
// Mirrored direction of the coat; about the geometric normal where the coat's own would send it into the surface.
vec3 coat_mirror_direction(surface s, vec3 direction)
{
    vec3 mirrored = reflect(direction, s.coat_normal);
    return dot(mirrored, s.geometric) > 0.0 ? mirrored : reflect(direction, s.geometric);
}

// The coat's own highlight for the irradiance from a direction, in the form of brdf(), times the cosine to the coat.
// `roughness`: the coat's, or a wider one.
float coat_highlight(surface s, coating c, vec3 view, vec3 light, float roughness)
{
    float NoL = dot(s.coat_normal, light), NoV = coat_cosine(s, view), alpha = square(roughness);
    if (NoL <= 0.0 || dot(s.geometric, light) <= 0.0 || c.mirrors <= 0.0)
        return 0.0;
    vec3 half_way = normalize(view + light), across = cross(s.coat_normal, half_way);
    float NoH = clamp(dot(s.coat_normal, half_way), 0.0, 1.0), VoH = clamp(dot(view, half_way), 0.0, 1.0);
    return s.coat * fresnel_dielectric(VoH, COAT_IOR) * D_GGX(NoH, dot(across, across), alpha) *
           V_SmithGGXCorrelated(NoV, NoL, alpha) * NoL;
}
#endif
