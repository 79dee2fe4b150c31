// SPDX-License-Identifier: MIT
// How a surface scatters light: the shares of the light along the view that it reflects, scatters and refracts, and its
// reflectance from a light to the eye.
//
// A dielectric reflects by Fresnel's equations, a metal by Schlick's approximation, both from rough facets. What a facet
// sends into another one is not lost: a metal mirrors it again until it comes out, in all directions; at a dielectric it
// enters. A rough surface has no one mirror direction, and one ray cannot blur: as the roughness grows, its mirror ray is
// faded out and what it carried is replaced by the irradiance about that direction. What is reflected, refracted and
// scattered adds up to what arrives and never to more, be it from all around (struct split) or from a light (brdf);
// tests/accuracy/shading_energy.c holds both to it.
//
// Defines: those of common/material.glsl.

#include "shared/material.h"
#include "common/brdf.glsl"
#include "common/coat.glsl"
#include "common/facet_albedo.glsl"
#include "common/film.glsl"
#include "common/material.glsl"

// Roughness at which the mirror ray begins to fade; at MIRROR_ROUGHNESS_GONE it is gone.
const float MIRROR_ROUGHNESS_SHARP = 0.1;

float mirror_ray_share(float roughness)
{
    return 1.0 - smoothstep(MIRROR_ROUGHNESS_SHARP, MIRROR_ROUGHNESS_GONE, roughness);
}

// What a dielectric does with light from outside: SHARE is a colour if some mirror has one.
#if defined(HAS_SPECULAR) || defined(HAS_IRIDESCENCE)
#define SHARE vec3
#else
#define SHARE float
#endif

// `exact`: what the equations say that facets mirror; `all_`: what they would if they mirrored all light.
SHARE without_film(surface s, float exact, float all_)
{
#ifdef HAS_SPECULAR
    // KHR_materials_specular: Fresnel's curve from its value at normal incidence up to 1 begins at another one, of a
    // colour, and all of it is less. As the change is the same line at every angle, it holds for means over facets and
    // angles, too.
    float f0 = square((s.ior - 1.0) / (s.ior + 1.0));
    vec3 begins = min(f0 * s.specular_colour, 1.0);
    return s.specular * (begins * all_ + (1.0 - begins) * max((exact - f0 * all_) / (1.0 - f0), 0.0));
#else
    return SHARE(exact);
#endif
}

// What a facet of a dielectric mirrors of light from outside, or facets of which it is the mean one.
SHARE outside_mirror(surface s, float cosine, float exact, float all_)
{
    SHARE mirrored = without_film(s, exact, all_);
#ifdef HAS_IRIDESCENCE
    mirrored = mix(mirrored, film_of(s, cosine) * all_, s.film);
#endif
    return mirrored;
}

// What facets mirror at the first go. `mean`: facets_cosine().
SHARE facets_outside_mirror(surface s, float mean, float loss, float alpha)
{
    float cosine = facets_dielectric_cosine(mean, alpha, s.ior), all_ = 1.0 - loss;
    float exact = fresnel_dielectric(cosine, s.ior) * all_;
    // A film's curve bends more, so facets at the horizon count for more; found by trial, so that no light is made.
    return outside_mirror(s, cosine * (1.0 - 0.3 * alpha * (1.0 - mean)), exact, all_);
}

// What a facet of a metal mirrors.
vec3 metal_mirror(surface s, float cosine)
{
    vec3 mirrored = fresnel_schlick(s.base, cosine);
#ifdef HAS_IRIDESCENCE
    mirrored = mix(mirrored, film_of(s, cosine), s.film);
#endif
    return mirrored;
}

// How a surface splits the light along the view; below a coat: what gets through it.
struct split {
    vec3 mirror;       // reflectance of the facets at the first go
    vec3 again;        // what they mirror more than once
    vec3 scattered;    // Lambert's albedo times what enters
    vec3 refracted;
    SHARE dielectric;  // share that does not enter
    float mirror_ray;  // share of `mirror` that the mirror ray carries; the rest is blurred
    float again_mean;  // facets_lost_mean()
    vec3 again_colour; // metal_again()
    SHARE enters_mean; // share of the light from all around that enters
    coating coat;
};

// `loss`: facets_lost() of the view, whose cosine is NoV.
split split_facets(surface s, vec3 view, float NoV, float alpha, float loss)
{
    bool leaves = s.inside && s.transmission > 0.0;
    float mean = facets_cosine(NoV, alpha);
    split result;
    // From inside of one direction: total reflection begins at an angle.
    result.dielectric = leaves ? SHARE(fresnel_dielectric(NoV, 1.0 / s.ior))
                               : facets_outside_mirror(s, mean, loss, alpha);
    result.again_mean = facets_lost_mean(alpha);
    SHARE mirrored_mean = without_film(s, facets_dielectric_mean(alpha, s.ior), 1.0 - result.again_mean);
    vec3 metal_mean = fresnel_schlick_mean(s.base);
#ifdef HAS_IRIDESCENCE
    vec3 film_mean = film_mean_of(s);
    mirrored_mean = mix(mirrored_mean, film_mean * (1.0 - result.again_mean), s.film);
    metal_mean = mix(metal_mean, film_mean, s.film);
#endif
    result.enters_mean = max(1.0 - mirrored_mean, SHARE(1e-6));
    result.mirror = mix(vec3(result.dielectric), metal_mirror(s, mean) * (1.0 - loss), s.metallic);
    result.again_colour = metal_again(metal_mean, result.again_mean);
    result.again = result.again_colour * (loss * s.metallic);
    SHARE enters = (1.0 - result.dielectric) * (1.0 - s.metallic);
    result.scattered = s.base * (enters * (1.0 - s.transmission));
    // Glass is tinted once, where light enters it.
    result.refracted = (leaves ? vec3(1.0) : s.base) * (enters * s.transmission);
    result.mirror_ray = leaves ? 1.0 : mirror_ray_share(s.roughness);
    result.coat = coating_of(s, view);
    result.mirror *= result.coat.passes;
    result.again *= result.coat.passes;
    result.scattered *= result.coat.passes;
    result.refracted *= result.coat.passes;
    return result;
}

split split_light(surface s, vec3 view, float NoV)
{
    float alpha = square(s.roughness);
    return split_facets(s, view, NoV, alpha, facets_lost(stretched_cosine(NoV, alpha), alpha));
}

// What goes to the eye of the light from a direction that enters, per steradian. `loss`: facets_lost() of that direction;
// reciprocal, as `parts` have the same factors for the view. Shirley et al. A Practitioners' Assessment of Light
// Reflection Models. 1997.
vec3 spread_scattered(surface s, split parts, float NoL, float alpha, float loss)
{
    SHARE enters = 1.0 - facets_outside_mirror(s, facets_cosine(NoL, alpha), loss, alpha);
    return parts.scattered * (enters / parts.enters_mean * INVERSE_PI);
}

// What enters or is mirrored again. Kulla, Conty 2017.
vec3 spread_out(surface s, split parts, float NoL, float alpha, float loss)
{
    return spread_scattered(s, parts, NoL, alpha, loss) + parts.again * (loss / max(parts.again_mean, 1e-9) * INVERSE_PI);
}

// The share of the light that a coat's mirror ray carries.
float coat_ray_of(surface s, split parts)
{
#ifdef HAS_CLEARCOAT
    return parts.coat.mirrors * mirror_ray_share(s.coat_roughness);
#else
    return 0.0;
#endif
}

// The mirrored direction; about the geometric normal where the shading normal would send it into the surface.
vec3 mirror_direction(surface s, vec3 direction)
{
    vec3 mirrored = reflect(direction, s.normal);
    return dot(mirrored, s.geometric) > 0.0 ? mirrored : reflect(direction, s.geometric);
}

// Of brdf() what is scattered, not mirrored, be it once or again; NoL > 0.
vec3 brdf_scattered(surface s, split parts, vec3 light)
{
    float alpha = square(s.roughness), NoL = dot(s.normal, light);
    return spread_scattered(s, parts, NoL, alpha, facets_lost(stretched_cosine(NoL, alpha), alpha)) *
           coat_over_scattered(parts.coat, s, light);
}

// Share of the irradiance from a direction (of a light, unit) that goes to the eye, per steradian; without the cosine,
// and without what a coat mirrors. 0 from below the horizon, and for glass seen from inside, where no light is sampled.
// Reciprocal. `parts`: of the same surface and NoV.
//
// What is mirrored: Cook and Torrance 1982 with GGX. (1 - F) of the half-way vector alone, as often seen for scattered
// light, would give out up to 1.7 of what arrives at grazing angles.
vec3 brdf(surface s, split parts, vec3 view, float NoV, vec3 light)
{
    float NoL = dot(s.normal, light);
    if (NoL <= 0.0 || dot(s.geometric, light) <= 0.0)
        return vec3(0.0);
    vec3 half_way = normalize(view + light), across = cross(s.normal, half_way);
    float NoH = clamp(dot(s.normal, half_way), 0.0, 1.0), VoH = clamp(dot(view, half_way), 0.0, 1.0);
    vec3 mirror = mix(vec3(outside_mirror(s, VoH, fresnel_dielectric(VoH, s.ior), 1.0)), metal_mirror(s, VoH), s.metallic);
    float wide = square(max(s.roughness, ROUGHNESS_MIN_LIGHT)), alpha = square(s.roughness);
    vec3 specular = mirror * (D_GGX(NoH, dot(across, across), wide) * V_SmithGGXCorrelated(NoV, NoL, wide));
    float loss = facets_lost(stretched_cosine(NoL, alpha), alpha);
    return spread_out(s, parts, NoL, alpha, loss) * coat_over_scattered(parts.coat, s, light) +
           specular * coat_over_mirrored(parts.coat, s, light);
}

// The same of all that is there, times the cosine.
vec3 reflected(surface s, split parts, vec3 view, float NoV, vec3 light)
{
    vec3 sent = brdf(s, parts, view, NoV, light) * max(dot(s.normal, light), 0.0);
#ifdef HAS_CLEARCOAT
    sent += coat_highlight(s, parts.coat, view, light, max(s.coat_roughness, ROUGHNESS_MIN_LIGHT));
#endif
    return sent;
}
