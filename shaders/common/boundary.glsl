// SPDX-License-Identifier: MIT
// Reflection and refraction at one facet, or at a smooth boundary: dielectrics by Fresnel's equations, metals by
// Schlick's approximation, each modified by KHR_materials_specular, _iridescence and _dispersion.
//
// Defines: those of common/material.glsl.

#include "common/brdf.glsl"
#include "common/facet_albedo.glsl"
#include "common/film.glsl"
#include "common/material.glsl"

// Type of a dielectric's reflectance for light from outside: a colour if some mirror has one.
#if defined(HAS_SPECULAR) || defined(HAS_IRIDESCENCE) || defined(HAS_DISPERSION)
#define SHARE vec3
#else
#define SHARE float
#endif

// Reflectance without a film. `exact`: the facets' share by the equations; `all_`: their share if they mirrored all
// light.
SHARE without_film(surface s, float exact, float all_)
{
#ifdef HAS_SPECULAR
    // KHR_materials_specular: Fresnel's curve from its value at normal incidence up to 1 gets another beginning, a
    // colour, and is scaled down. The change is the same line at every angle, so it holds for means over facets and
    // angles, too.
    float f0 = square((s.ior - 1.0) / (s.ior + 1.0));
    vec3 begins = min(f0 * s.specular_colour, 1.0);
    return s.specular * (begins * all_ + (1.0 - begins) * max((exact - f0 * all_) / (1.0 - f0), 0.0));
#else
    return SHARE(exact);
#endif
}

// Reflectance of a dielectric's facet, or of facets with this mean, for light from outside.
SHARE outside_mirror(surface s, float cosine, float exact, float all_)
{
    SHARE mirrored = without_film(s, exact, all_);
#ifdef HAS_IRIDESCENCE
    mirrored = mix(mirrored, film_of(s, cosine) * all_, s.film);
#endif
    return mirrored;
}

// First reflection of facets for light from outside, along a view with this cosine. `mean`: facets_cosine() of it;
// `loss`: the share that facets send into each other.
SHARE facets_outside_mirror(surface s, float cosine, float mean, float alpha, float loss)
{
    float all_ = 1.0 - loss;
    float exact = fresnel_dielectric(facets_dielectric_cosine(mean, alpha, s.ior), s.ior) * all_;
    SHARE mirrored = without_film(s, exact, all_);
#ifdef HAS_IRIDESCENCE
    mirrored = mix(mirrored, facets_film(s, cosine, alpha) * all_, s.film);
#endif
    return mirrored;
}

// Reflectance of a metal's facet.
vec3 metal_mirror(surface s, float cosine)
{
    vec3 mirrored = fresnel_schlick(s.base, cosine);
#ifdef HAS_IRIDESCENCE
    mirrored = mix(mirrored, film_of(s, cosine), s.film);
#endif
    return mirrored;
}

vec3 facets_metal_mirror(surface s, float cosine, float mean, float alpha, float loss)
{
    vec3 mirrored = fresnel_schlick(s.base, mean);
#ifdef HAS_IRIDESCENCE
    mirrored = mix(mirrored, facets_film(s, cosine, alpha), s.film);
#endif
    return mirrored * (1.0 - loss);
}

// Direction of the light that a facet refracts; 0: it is totally reflected. In a thin wall facets of both sides bend it:
// it is the mirrored direction on the other side (KHR_materials_transmission).
vec3 bent_direction(surface s, float eta, vec3 direction, vec3 facet, vec3 normal)
{
#ifdef HAS_THIN_WALLS
    if (is_thin(s)) {
        vec3 mirrored = reflect(direction, facet);
        float height = dot(mirrored, normal);
        return mirrored - (height + abs(height)) * normal;
    }
#endif
    return refract(direction, facet, 1.0 / eta);
}

// Reflectance of a boundary for light from inside of glass.
SHARE inside_mirror(surface s, float cosine)
{
#ifdef HAS_DISPERSION
    vec3 ior = channel_iors(s);
    return vec3(fresnel_dielectric(cosine, 1.0 / ior.r), fresnel_dielectric(cosine, 1.0 / ior.g),
                fresnel_dielectric(cosine, 1.0 / ior.b));
#else
    return SHARE(fresnel_dielectric(cosine, 1.0 / s.ior));
#endif
}

// Chooses a colour that glass with dispersion transmits, with a chance in proportion to its contribution to the path, and
// bends it accordingly. `number` chooses it and is stretched to [0, 1) again; `window` becomes the colour's share divided
// by its chance. Returns the index behind / before.
float disperse(surface s, inout float number, inout vec3 window)
{
    float eta = index_ratio(s);
#ifdef HAS_DISPERSION
    vec3 sizes = window * s.carried, iors = channel_iors(s);
    float all_ = sizes.r + sizes.g + sizes.b;
    if (s.dispersion <= 0.0 || is_thin(s) || !(all_ > 0.0))
        return eta;
    int chosen = number * all_ < sizes.r ? 0 : number * all_ < sizes.r + sizes.g ? 1 : 2;
    float before = chosen == 0 ? 0.0 : chosen == 1 ? sizes.r : sizes.r + sizes.g;
    float chance = sizes[chosen] / all_, kept = window[chosen] / chance;
    number = clamp((number - before / all_) / chance, 0.0, 0.99999994);
    window = vec3(0.0);
    window[chosen] = kept;
    eta = s.inside ? 1.0 / iors[chosen] : iors[chosen];
#endif
    return eta;
}
