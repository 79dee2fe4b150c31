// SPDX-License-Identifier: MIT
// Scattering of light at a surface: the shares of the light along the view that it reflects, scatters and refracts, and
// its reflectance from a light to the eye.
//
// A dielectric reflects by Fresnel's equations, a metal by Schlick's approximation, both from rough facets. Light that a
// facet sends into another one is not lost: a metal mirrors it again until it leaves the surface, in all directions; into
// a dielectric it enters. A rough surface has no single mirror direction, and one ray cannot blur: as the roughness
// grows, the mirror ray fades out and the irradiance about that direction takes its place. Reflection, refraction and
// scattering add up to the arriving light and never to more, be it from all around (struct split) or from a light (brdf);
// tests/accuracy/bsdf.c checks both.
//
// Defines: those of common/material.glsl.

#include "shared/material.h"
#include "common/boundary.glsl"
#include "common/brdf.glsl"
#include "common/coat.glsl"
#include "common/grain.glsl"
#include "common/sheen.glsl"

// Roughness at which the mirror ray begins to fade; at MIRROR_ROUGHNESS_GONE it is gone.
const float MIRROR_ROUGHNESS_SHARP = 0.1;

float mirror_ray_share(float roughness)
{
    return 1.0 - smoothstep(MIRROR_ROUGHNESS_SHARP, MIRROR_ROUGHNESS_GONE, roughness);
}

// Division of the light along the view by a surface; below a coat: of the light that passes the coat.
struct split {
    vec3 mirror;       // reflectance of the facets at the first reflection
    vec3 again;        // reflectance by further reflections
    vec3 scattered;    // Lambert's albedo times the share that enters
    vec3 refracted;
    SHARE dielectric;  // share that does not enter
    float mirror_ray;  // share of `mirror` that the mirror ray carries; the rest is blurred
    float again_mean;  // facets_lost_mean()
    vec3 again_colour; // metal_again()
    SHARE enters_mean; // share of the light from all around that enters
#ifdef HAS_SHEEN
    vec3 sheen;          // share of the light from all around that fibres reflect
    float beneath;       // share of the light along the view that fibres let pass
    float beneath_mean;  // and of the light from all around
#endif
#ifdef HAS_DIFFUSE_TRANSMISSION
    vec3 passed; // light scattered to the other side
#endif
    coating coat;
};

// Layers over the surface: fibres, and a coat over these. Shares of light that they let through: along the view; from a
// direction, to be mirrored; and from a direction, to be scattered and return to the view, divided by the share along the
// view.
#ifdef HAS_SHEEN
float sheen_leaves(surface s, vec3 direction)
{
    return 1.0 - max_component(s.sheen) * sheen_albedo(max(dot(s.normal, direction), 0.0), s.sheen_roughness);
}

float over_view(split parts)
{
    return parts.beneath * parts.coat.passes;
}

float over_mirrored(surface s, split parts, vec3 light)
{
    return min(parts.beneath, sheen_leaves(s, light)) * coat_over_mirrored(parts.coat, s, light);
}

float over_scattered(surface s, split parts, vec3 light)
{
    return sheen_leaves(s, light) / parts.beneath_mean * coat_over_scattered(parts.coat, s, light);
}

// Reflection of fibres from a direction, per steradian, and of the light from all around.
vec3 sheen_sent(surface s, split parts, vec3 view, float NoV, vec3 light)
{
    float NoH = dot(s.normal, normalize(view + light)), NoL = dot(s.normal, light);
    return s.sheen * (sheen_reflectance(s.sheen_roughness, NoH, NoV, NoL) * parts.coat.passes *
                      coat_over_scattered(parts.coat, s, light));
}

vec3 sheen_of(split parts)
{
    return parts.sheen;
}
#else
float over_view(split parts)
{
    return parts.coat.passes;
}

float over_mirrored(surface s, split parts, vec3 light)
{
    return coat_over_mirrored(parts.coat, s, light);
}

float over_scattered(surface s, split parts, vec3 light)
{
    return coat_over_scattered(parts.coat, s, light);
}

vec3 sheen_sent(surface s, split parts, vec3 view, float NoV, vec3 light)
{
    return vec3(0.0);
}

vec3 sheen_of(split parts)
{
    return vec3(0.0);
}
#endif

// KHR_materials_diffuse_transmission: a share of the scattered light leaves at the other side, as if it had entered
// there.
#ifdef HAS_DIFFUSE_TRANSMISSION
void scatter_to_other_side(surface s, SHARE entered, inout split parts)
{
    parts.scattered *= 1.0 - s.diffuse_transmission;
    parts.passed = s.diffuse_colour * (entered * s.diffuse_transmission);
}

vec3 passed_of(split parts)
{
    return parts.passed;
}

// Share of the scattered light that goes to the other side: the probability of sampling lights there.
float passed_share(split parts)
{
    float size = max_component(parts.passed);
    return size / max(size + max_component(parts.scattered + parts.again + sheen_of(parts)), 1e-30);
}
#else
void scatter_to_other_side(surface s, SHARE entered, inout split parts) {}

vec3 passed_of(split parts)
{
    return vec3(0.0);
}

float passed_share(split parts)
{
    return 0.0;
}
#endif

// Chooses the side of the surface on which to sample lights: -1 behind it. `number` chooses and is stretched to [0, 1)
// again; `chance` is the probability of the choice.
float side_choose(split parts, inout float number, out float chance)
{
    chance = 1.0;
#ifdef HAS_DIFFUSE_TRANSMISSION
    float share = passed_share(parts);
    bool behind = is_in(share, number);
    chance = behind ? share : 1.0 - share;
    return behind ? -1.0 : 1.0;
#endif
    return 1.0;
}

// Probability of side_choose() for the side of a direction that another technique sampled.
float side_chance(split parts, float cosine)
{
#ifdef HAS_DIFFUSE_TRANSMISSION
    float share = passed_share(parts);
    return cosine < 0.0 ? share : 1.0 - share;
#endif
    return 1.0;
}

void put_below(surface s, vec3 view, float NoV, inout split parts)
{
    parts.coat = coating_of(s, view);
#ifdef HAS_SHEEN
    parts.sheen = s.sheen * (sheen_albedo(NoV, s.sheen_roughness) * parts.coat.passes);
    parts.beneath = 1.0 - max_component(s.sheen) * sheen_albedo(NoV, s.sheen_roughness);
    parts.beneath_mean = 1.0 - max_component(s.sheen) * sheen_albedo_mean(s.sheen_roughness);
#endif
    parts.mirror *= over_view(parts);
    parts.again *= over_view(parts);
    parts.scattered *= over_view(parts);
    parts.refracted *= over_view(parts);
#ifdef HAS_DIFFUSE_TRANSMISSION
    parts.passed *= over_view(parts);
#endif
}

// Splits the light at the facets. `loss`: facets_lost() of the view, whose cosine is NoV.
split split_facets(surface s, vec3 view, float NoV, float alpha, float loss)
{
    bool leaves = in_glass(s);
    float mean = facets_cosine(NoV, alpha);
    split result;
    // From inside, a single direction is enough: total reflection begins at an angle.
    result.dielectric = leaves ? inside_mirror(s, NoV) : facets_outside_mirror(s, NoV, mean, alpha, loss);
    result.again_mean = facets_lost_mean(alpha);
    SHARE mirrored_mean = without_film(s, facets_dielectric_mean(alpha, s.ior), 1.0 - result.again_mean);
    vec3 metal_mean = fresnel_schlick_mean(s.base);
#ifdef HAS_IRIDESCENCE
    vec3 film_mean = facets_film_mean(s, alpha);
    mirrored_mean = mix(mirrored_mean, film_mean * (1.0 - result.again_mean), s.film);
    metal_mean = mix(metal_mean, film_mean, s.film);
#endif
    result.enters_mean = max(1.0 - mirrored_mean, SHARE(1e-6));
    result.mirror = mix(vec3(result.dielectric), facets_metal_mirror(s, NoV, mean, alpha, loss), s.metallic);
    result.again_colour = metal_again(metal_mean, result.again_mean);
    result.again = result.again_colour * (loss * s.metallic);
    SHARE enters = (1.0 - result.dielectric) * (1.0 - s.metallic), entered = enters * (1.0 - s.transmission);
    result.scattered = s.base * entered;
    // Glass is tinted once, where light enters it.
    result.refracted = (leaves ? vec3(1.0) : s.base) * (enters * s.transmission);
    result.mirror_ray = leaves ? 1.0 : mirror_ray_share(blurring_roughness(s));
    scatter_to_other_side(s, entered, result);
    put_below(s, view, NoV, result);
    return result;
}

split split_light(surface s, vec3 view, float NoV)
{
    return split_facets(s, view, NoV, facets_alpha(s), facets_lost_from(s, view, NoV));
}

// Share of the light from a direction that enters, relative to that of the light from all around, per steradian. `loss`:
// facets_lost() of that direction; scattering is reciprocal, as `parts` have the same factors for the view. Shirley et
// al. A Practitioners' Assessment of Light Reflection Models. 1997.
SHARE spread_entered(surface s, split parts, float NoL, float alpha, float loss)
{
    SHARE enters = 1.0 - facets_outside_mirror(s, NoL, facets_cosine(NoL, alpha), alpha, loss);
    return enters / parts.enters_mean * INVERSE_PI;
}

vec3 spread_scattered(surface s, split parts, float NoL, float alpha, float loss)
{
    return parts.scattered * spread_entered(s, parts, NoL, alpha, loss);
}

// Reflection after several facets. Kulla, Conty 2017.
vec3 spread_again(split parts, float loss)
{
    return parts.again * (loss / max(parts.again_mean, 1e-9) * INVERSE_PI);
}

vec3 spread_out(surface s, split parts, float NoL, float alpha, float loss)
{
    return spread_scattered(s, parts, NoL, alpha, loss) + spread_again(parts, loss);
}

// Share of the light that a coat's mirror ray carries.
float coat_ray_of(surface s, split parts)
{
#ifdef HAS_CLEARCOAT
    return parts.coat.mirrors * mirror_ray_share(s.coat_roughness);
#else
    return 0.0;
#endif
}

// Mirrored direction; about the geometric normal where the shading normal would send it into the surface.
vec3 mirror_direction(surface s, vec3 direction)
{
    vec3 mirrored = reflect(direction, s.normal);
    return dot(mirrored, s.geometric) > 0.0 ? mirrored : reflect(direction, s.geometric);
}

// Transmitted part of brdf(): light scattered from the other side.
vec3 brdf_passed(surface s, split parts, vec3 light)
{
    float NoL = -dot(s.normal, light);
    if (NoL <= 0.0 || dot(s.geometric, light) >= 0.0)
        return vec3(0.0);
    return passed_of(parts) * spread_entered(s, parts, NoL, facets_alpha(s), facets_lost_from(s, light, NoL)) *
           over_scattered(s, parts, -light);
}

// Scattered part of brdf(), with that of fibres but without single and multiple reflections.
vec3 brdf_scattered(surface s, split parts, vec3 view, float NoV, vec3 light)
{
    float NoL = dot(s.normal, light);
    if (NoL <= 0.0 || dot(s.geometric, light) <= 0.0)
        return brdf_passed(s, parts, light);
    return spread_scattered(s, parts, NoL, facets_alpha(s), facets_lost_from(s, light, NoL)) *
               over_scattered(s, parts, light) +
           sheen_sent(s, parts, view, NoV, light);
}

// Share of the irradiance from a direction (of a light, unit) that goes to the eye, per steradian; without the cosine,
// and without a coat's reflection. For a light below the horizon only scattering to the other side counts, and 0 for
// glass seen from inside, where no light is sampled. Reciprocal. `parts`: of the same surface and NoV. `shine`: 0 leaves
// out the highlight.
//
// The mirrored part is facets_mirror(). A factor (1 - F) of the half-way vector alone, as often seen for scattered light,
// would emit up to 1.7 of the arriving light at grazing angles.
vec3 brdf(surface s, split parts, vec3 view, float NoV, vec3 light, float shine)
{
    float NoL = dot(s.normal, light);
    if (NoL <= 0.0 || dot(s.geometric, light) <= 0.0)
        return brdf_passed(s, parts, light);
    float VoH = clamp(dot(view, normalize(view + light)), 0.0, 1.0);
    vec3 mirror = mix(vec3(outside_mirror(s, VoH, fresnel_dielectric(VoH, s.ior), 1.0)), metal_mirror(s, VoH), s.metallic);
    vec3 specular = mirror * (shine * facets_mirror(s, max(s.roughness, ROUGHNESS_MIN_LIGHT), view, NoV, light, NoL));
    float loss = facets_lost_from(s, light, NoL);
    return spread_out(s, parts, NoL, facets_alpha(s), loss) * over_scattered(s, parts, light) +
           specular * over_mirrored(s, parts, light) + sheen_sent(s, parts, view, NoV, light);
}

vec3 brdf(surface s, split parts, vec3 view, float NoV, vec3 light)
{
    return brdf(s, parts, view, NoV, light, 1.0);
}

// Value of brdf() with all layers, times the cosine.
vec3 reflected(surface s, split parts, vec3 view, float NoV, vec3 light, float shine)
{
    vec3 sent = brdf(s, parts, view, NoV, light, shine) * abs(dot(s.normal, light));
#ifdef HAS_CLEARCOAT
    sent += coat_highlight(s, parts.coat, view, light, max(s.coat_roughness, ROUGHNESS_MIN_LIGHT));
#endif
    return sent;
}

vec3 reflected(surface s, split parts, vec3 view, float NoV, vec3 light)
{
    return reflected(s, parts, view, NoV, light, 1.0);
}
