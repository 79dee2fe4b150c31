// SPDX-License-Identifier: MIT
// The BSDF for estimators that sample directions from it and weigh them by their probability density: bsdf_evaluate()
// and bsdf_choose() implement one model, and bsdf_evaluate() returns the density with which bsdf_choose() samples a
// direction.
//
//   scattered   Lambert, diminished by the boundary both ways, and multiple reflections of metal, as in brdf() of
//               common/scattering.glsl
//   mirrored    GGX facets, each a smooth mirror by Fresnel's equations (metal: Schlick); or Ward's lobe with the same
//               reflectances
//   refracted   GGX facets as windows, which also transmit the light mirrored into another facet
//
//   coat        GGX facets over all of them (common/coat.glsl)
//
// Mirrored and refracted may be stretched along a grain. Where they are smooth they are a mirror and a window, which only
// bsdf_choose() finds; it alone also finds light inside of glass, where both are GGX's. Radiance on the other side is
// divided by the square of the index, so that a window neither dims nor brightens the view through it.
//
// Defines: those of common/material.glsl; WARD; LIGHT_LAYERS the scattered part is needed apart.

#include "common/grain.glsl"
#include "common/scattering.glsl"

// Minimum probability of a lobe, as its value at this angle may exceed its mean.
const float LOBE_CHANCE_MIN = 1e-3;

struct bsdf {
    vec3 x, y, z;           // unit, world space: along the grain, across it, shading normal
    vec3 view;              // in that frame, towards the eye, z > 0
    vec2 alpha;             // roughness of the facets along x and y
    bool rough;             // else mirror and window are smooth
    bool leaves;            // the ray comes from inside of glass
    split parts;            // nothing is scattered from inside of glass: bsdf_choose() does that by facets
    float scattered_chance; // probability of choosing that lobe
    float mirror_chance;    // WARD: probability of the mirror otherwise
#ifdef HAS_CLEARCOAT
    vec3 coat_x, coat_y, coat_view; // the coat's frame with its normal, and the view in it
    float coat_alpha, coat_chance;  // probability of choosing its lobe
    bool coat_rough;
#endif
};

vec3 bsdf_local(bsdf b, vec3 direction)
{
    return vec3(dot(direction, b.x), dot(direction, b.y), dot(direction, b.z));
}

vec3 bsdf_world(bsdf b, vec3 local)
{
    return local.x * b.x + local.y * b.y + local.z * b.z;
}

float bsdf_lost(bsdf b, vec3 direction)
{
    vec2 mean = facet_alpha_mean(b.alpha);
    return mean.y * facets_lost(facet_stretched(direction, b.alpha), mean.x);
}

// Prepares the BSDF. `view` is the direction to the eye; NoV is not 0.
bsdf bsdf_of(surface s, vec3 view, float NoV)
{
    bsdf b;
    vec3 unused;
    facet_axes(s, b.x, unused);
    b.y = cross(s.normal, b.x);
    b.z = s.normal;
    vec3 local = bsdf_local(b, view);
    b.view = normalize(vec3(local.xy, NoV));
    b.alpha = facet_alpha(s, s.roughness);
    b.rough = b.alpha.x > FACET_ALPHA_MIN;
    b.leaves = in_glass(s);
    float loss = b.rough ? bsdf_lost(b, b.view) : 0.0;
    b.parts = split_facets(s, view, NoV, facet_alpha_mean(b.alpha).x, loss);
    b.alpha = max(b.alpha, vec2(FACET_ALPHA_MIN));
    if (b.leaves)
        b.parts.scattered = b.parts.again = vec3(0.0);
    float scattered = max_component(b.parts.scattered + b.parts.again + sheen_of(b.parts)) +
                      max_component(passed_of(b.parts));
    float mirror = max_component(b.parts.mirror), refracted = max_component(b.parts.refracted);
    float facets = mirror + refracted > 0.0 ? max(mirror + refracted, LOBE_CHANCE_MIN) : 0.0;
    b.scattered_chance = b.leaves ? 0.0 : scattered + facets > 0.0 ? scattered / (scattered + facets) : 1.0;
    b.mirror_chance = max(mirror, LOBE_CHANCE_MIN) / (max(mirror, LOBE_CHANCE_MIN) + refracted);
#ifdef HAS_CLEARCOAT
    tangent_frame(s.coat_normal, b.coat_x, b.coat_y);
    b.coat_view = normalize(vec3(dot(view, b.coat_x), dot(view, b.coat_y), coat_cosine(s, view)));
    b.coat_alpha = square(s.coat_roughness);
    b.coat_rough = b.coat_alpha > FACET_ALPHA_MIN;
    float coat = b.parts.coat.mirrors, below = scattered + facets;
    coat = coat > 0.0 ? max(coat, LOBE_CHANCE_MIN) : 0.0;
    b.coat_chance = coat > 0.0 ? coat / (coat + below) : 0.0;
#endif
    return b;
}

// Share of the light mirrored by a facet that no other facet blocks; light from inside of glass stays there.
float bsdf_lit(bsdf b, vec3 light)
{
#ifndef WARD
    if (b.rough && !b.leaves)
        return light.z > 0.0 ? facet_both_share(b.view, light, b.alpha) : 0.0;
#endif
    return 1.0;
}

// Reflectance and transmittance of a facet. `light`: the direction that it mirrors.
void facet_parts(bsdf b, surface s, float VoH, vec3 light, out vec3 mirror, out vec3 window)
{
    float lit = bsdf_lit(b, light);
    SHARE dielectric = b.leaves ? inside_mirror(s, VoH) : outside_mirror(s, VoH, fresnel_dielectric(VoH, s.ior), 1.0);
    SHARE mirrored = dielectric * lit;
#ifdef WARD
    if (!b.leaves && b.rough) // its mirror and its window have different facets
        mirrored = b.parts.dielectric;
#endif
    mirror = mix(vec3(dielectric), metal_mirror(s, VoH), s.metallic) *
             (lit * over_mirrored(s, b.parts, bsdf_world(b, light)));
    // Glass is tinted once, where light enters it. Scattering, too, is left to the inside.
    vec3 through = b.leaves ? mix(s.base, vec3(1.0), s.transmission) : s.base * s.transmission;
    window = through * ((1.0 - mirrored) * ((1.0 - s.metallic) * over_view(b.parts)));
}

// Probability of choosing the mirror over the window. Ward's lobe has other facets than the window, so it is chosen
// before the facet.
float facet_mirror_chance(bsdf b, vec3 mirror, vec3 window)
{
#ifdef WARD
    if (!b.leaves)
        return b.mirror_chance;
#endif
    float size = max_component(mirror), both = size + max_component(window);
    return both > 0.0 ? size / both : 1.0;
}

// The counterpart of evaluate_below() for light scattered from the other side.
vec3 bsdf_passed(bsdf b, surface s, vec3 light, vec3 light_world, out float probability)
{
    probability = 0.0;
    if (light.z >= 0.0 || dot(s.geometric, light_world) >= 0.0 || b.leaves)
        return vec3(0.0);
    probability = b.scattered_chance * passed_share(b.parts) * -light.z * INVERSE_PI;
    float alpha = facet_alpha_mean(b.alpha).x, loss = bsdf_lost(b, vec3(light.xy, -light.z));
    return passed_of(b.parts) * (spread_entered(s, b.parts, -light.z, alpha, loss) * -light.z) *
           over_scattered(s, b.parts, -light_world);
}

#ifdef LIGHT_LAYERS
vec3 evaluated_scattered; // scattered part of the last bsdf_evaluate()
#endif

// Evaluates the surface below a coat, as bsdf_evaluate() would if only its lobes could be chosen.
vec3 evaluate_below(bsdf b, surface s, vec3 light_world, out float probability)
{
    vec3 light = bsdf_local(b, light_world);
    if (light.z <= 0.0 || dot(s.geometric, light_world) <= 0.0 || b.leaves) {
        vec3 passed = bsdf_passed(b, s, light, light_world, probability);
#ifdef LIGHT_LAYERS
        evaluated_scattered = passed;
#endif
        return passed;
    }
    vec3 facet = normalize(b.view + light), mirror, window;
    float lost = bsdf_lost(b, light), over = over_scattered(s, b.parts, light_world);
    vec3 sent = spread_out(s, b.parts, light.z, facet_alpha_mean(b.alpha).x, lost) * over;
    sent = (sent + sheen_sent(s, b.parts, bsdf_world(b, b.view), b.view.z, light_world)) * light.z;
#ifdef LIGHT_LAYERS
    evaluated_scattered = sent - spread_again(b.parts, lost) * (over * light.z);
#endif
    probability = b.scattered_chance * (1.0 - passed_share(b.parts)) * light.z * INVERSE_PI;
    if (!b.rough)
        return sent;
    float VoH = clamp(dot(b.view, facet), 1e-6, 1.0);
    facet_parts(b, s, VoH, light, mirror, window);
    float chance = (1.0 - b.scattered_chance) * facet_mirror_chance(b, mirror, window);
#ifdef WARD
    float lobe_density = ward_density(facet, VoH, b.alpha);
    sent += mirror * (ward_weight(b.view, light, facet, VoH) * lobe_density);
#else
    float lobe_density = visible_facet_density(facet, b.view, VoH, b.alpha) / (4.0 * VoH);
    sent += mirror * lobe_density;
#endif
    probability += chance * lobe_density;
    return sent;
}

// Reflectance from a direction (unit) to the eye, per steradian, times the cosine; and the probability per steradian with
// which bsdf_choose() samples it. Smooth mirrors and refraction are left out of both.
vec3 bsdf_evaluate(bsdf b, surface s, vec3 light_world, out float probability)
{
    vec3 sent = evaluate_below(b, s, light_world, probability);
#ifdef HAS_CLEARCOAT
    vec3 light = vec3(dot(light_world, b.coat_x), dot(light_world, b.coat_y), dot(light_world, s.coat_normal));
    probability *= 1.0 - b.coat_chance;
    if (b.coat_rough && b.coat_chance > 0.0 && light.z > 0.0 && dot(s.geometric, light_world) > 0.0) {
        vec2 alpha = vec2(b.coat_alpha);
        vec3 facet = normalize(b.coat_view + light);
        float VoH = clamp(dot(b.coat_view, facet), 1e-6, 1.0);
        float density = visible_facet_density(facet, b.coat_view, VoH, alpha) / (4.0 * VoH);
        float lit = facet_both_share(b.coat_view, light, alpha);
        sent += s.coat * fresnel_dielectric(VoH, COAT_IOR) * lit * density;
        probability += b.coat_chance * density;
    }
#endif
    return sent;
}

#define BSDF_SCATTERED 0u
#define BSDF_MIRRORED 1u
#define BSDF_REFRACTED 2u
#define BSDF_COAT 3u // mirrored by the coat

struct bsdf_choice {
    vec3 direction;    // unit, world space
    vec3 weight;       // factor of the radiance along it: reflectance times cosine / probability; 0: there is no ray
    float probability; // per steradian; 0: undefined (smooth, or through a window)
    uint lobe;         // BSDF_*
};

vec3 direction_by_cosine(vec2 u)
{
    float sine = sqrt(u.x), phi = TWO_PI * u.y;
    return vec3(sine * cos(phi), sine * sin(phi), sqrt(1.0 - u.x));
}

// Whether light that meets glass from inside, and is not mirrored, is scattered. One number makes two for its direction,
// from its upper and its lower bits.
bool scattered_inside(surface s, inout float choice, inout vec3 window, inout vec3 local)
{
    vec3 rest = s.base * (1.0 - s.transmission);
    float size = max_component(rest), chance = size / (size + s.transmission);
    bool scattered = choice < chance;
    choice = min(scattered ? choice / chance : (choice - chance) / (1.0 - chance), 0.99999994);
    vec3 whole = mix(s.base, vec3(1.0), s.transmission);
    window *= (scattered ? rest / chance : vec3(s.transmission / (1.0 - chance))) / whole;
    if (scattered)
        local = direction_by_cosine(vec2(choice, fract(choice * 4096.0)));
    return scattered;
}

// Chooses a direction. `choice` chooses the lobe and is stretched to [0, 1) again; `u` chooses the direction.
bsdf_choice bsdf_choose(bsdf b, surface s, inout float choice, vec2 u)
{
    bsdf_choice result = bsdf_choice(b.z, vec3(0.0), 0.0, BSDF_SCATTERED);
    float below = 1.0; // chance of the surface below the coat
#ifdef HAS_CLEARCOAT
    bool coated = choice < b.coat_chance;
    below = 1.0 - b.coat_chance;
    choice = clamp(coated ? choice / b.coat_chance : (choice - b.coat_chance) / below, 0.0, 0.99999994);
    vec3 coat_facet = b.coat_rough ? visible_facet(b.coat_view, vec2(b.coat_alpha), u) : vec3(0.0, 0.0, 1.0);
    vec3 coat_mirrored = reflect(-b.coat_view, coat_facet);
#endif
    bool scattered = choice < b.scattered_chance;
    float first = scattered ? b.scattered_chance : 1.0 - b.scattered_chance;
    choice = min((scattered ? choice : choice - b.scattered_chance) / first, 0.99999994);
    first *= below;
    vec3 facet = b.rough ? visible_facet(b.view, b.alpha, u) : vec3(0.0, 0.0, 1.0), mirror, window;
    float VoH = clamp(dot(b.view, facet), 1e-6, 1.0);
    vec3 mirrored_at = reflect(-b.view, facet);
    facet_parts(b, s, VoH, mirrored_at, mirror, window);
    float chance = facet_mirror_chance(b, mirror, window), eta = disperse(s, choice, window);
    vec3 bent = bent_direction(s, eta, -b.view, facet, vec3(0.0, 0.0, 1.0));
    if (!b.rough && dot(bsdf_world(b, bent), s.geometric) >= 0.0) { // totally reflected, or sent back by a tilted normal
        mirror += window;
        window = vec3(0.0);
        chance = facet_mirror_chance(b, mirror, window);
    }
    bool mirrored = choice < chance;
    if (!scattered)
        choice = min((mirrored ? choice : choice - chance) / (mirrored ? chance : 1.0 - chance), 0.99999994);
    vec3 local;
    if (scattered) {
        local = direction_by_cosine(u);
        local.z = is_in(passed_share(b.parts), choice) ? -local.z : local.z;
    } else if (mirrored) {
#ifdef WARD
        if (b.rough && !b.leaves)
            mirrored_at = reflect(-b.view, ward_facet(b.alpha, u));
#endif
        local = mirrored_at;
        result.lobe = BSDF_MIRRORED;
    } else {
        local = bent;
        result.lobe = BSDF_REFRACTED;
    }
    if (b.rough && b.leaves) // light mirrored into another facet goes where the flat surface would send it
        local.z = mirrored ? abs(local.z) : -abs(local.z);
    bool diffuse = b.leaves && !mirrored && scattered_inside(s, choice, window, local);
    if (diffuse)
        result.lobe = BSDF_SCATTERED;
    result.direction = normalize(bsdf_world(b, local));
#ifdef HAS_CLEARCOAT
    if (coated) {
        result.lobe = BSDF_COAT;
        result.direction = b.coat_rough ? normalize(coat_mirrored.x * b.coat_x + coat_mirrored.y * b.coat_y +
                                                    coat_mirrored.z * s.coat_normal)
                                        : coat_mirror_direction(s, -bsdf_world(b, b.view));
        diffuse = false;
    }
    if (coated && !b.coat_rough) {
        result.weight = vec3(b.parts.coat.mirrors / b.coat_chance);
        return result;
    }
#endif
    if (diffuse || result.lobe == BSDF_REFRACTED) {
        bool out_ = dot(result.direction, s.geometric) * local.z > 0.0 && dot(local, local) > 0.5;
        result.weight = out_ ? window / (first * (1.0 - chance)) : vec3(0.0);
    } else if (result.lobe == BSDF_MIRRORED && (!b.rough || b.leaves)) {
        if (dot(result.direction, s.geometric) <= 0.0) // about the surface itself, as in mirror_direction()
            result.direction = reflect(-bsdf_world(b, b.view), s.geometric);
        result.weight = mirror / (first * chance);
    } else {
        vec3 sent = bsdf_evaluate(b, s, result.direction, result.probability);
        if (result.probability > 0.0)
            result.weight = sent / result.probability;
    }
    return result;
}
