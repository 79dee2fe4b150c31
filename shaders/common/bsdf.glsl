// SPDX-License-Identifier: MIT
// The BSDF for estimators that sample directions from it and weigh them by their probability density: bsdf_evaluate()
// and bsdf_choose() implement one model, and bsdf_evaluate() returns the density with which bsdf_choose() samples a
// direction.
//
//   scattered   Lambert, diminished by the boundary both ways, as in brdf() of common/scattering.glsl
//   mirrored    GGX facets, each a smooth mirror by Fresnel's equations (metal: Schlick); or Ward's lobe with the same
//               reflectances
//   refracted   GGX facets as windows
//
// The last two may be stretched along a grain. Where they are smooth they are a mirror and a window, which nothing but
// bsdf_choose() finds. Radiance on the other side is divided by the square of the index, so that a window neither dims
// nor brightens the view through it.
//
// Defines: those of common/material.glsl; HAS_ANISOTROPY some material has a grain; WARD.

#include "common/facets.glsl"
#include "common/scattering.glsl"

// The minimum probability of a lobe, as its mean may exceed its value at this angle.
const float LOBE_CHANCE_MIN = 1e-3;

struct bsdf {
    vec3 x, y, z;           // unit, world space: along the grain, across it, shading normal
    vec3 view;              // in that frame, towards the eye, z > 0
    vec2 alpha;             // of the facets along x and y
    bool rough;             // else mirror and window are smooth
    bool leaves;            // the ray comes from inside of glass
    float eta;              // index behind / index before
    vec3 scattered;         // as in struct split, divided by pi and the mean share that enters
    float scattered_chance; // of choosing that lobe
    float mirror_chance;    // WARD: of choosing the mirror otherwise
};

// KHR_materials_anisotropy: facets are as rough as the material says across the grain, and up to fully rough along it.
vec2 facet_alpha(float roughness, float anisotropy)
{
    float across = square(roughness);
    return vec2(mix(across, 1.0, square(anisotropy)), across);
}

#ifdef HAS_ANISOTROPY
// Along the material's grain; a point without a tangent gets an arbitrary one.
vec3 grain_of(hit h, surface s, material m)
{
    vec3 x, y;
    tangent_frame(s.normal, x, y);
    if ((h.material & HIT_HAS_TANGENT) != 0u) {
        vec4 tangent = unpack_tangent(h.tangent);
        vec3 along = tangent.xyz - dot(tangent.xyz, s.normal) * s.normal;
        float squared = dot(along, along);
        if (squared > 1e-8) {
            x = along * inversesqrt(squared);
            y = cross(s.normal, x) * (s.inside ? -tangent.w : tangent.w);
        }
    }
    return cos(m.anisotropy_rotation) * x + sin(m.anisotropy_rotation) * y;
}
#endif

vec3 bsdf_local(bsdf b, vec3 direction)
{
    return vec3(dot(direction, b.x), dot(direction, b.y), dot(direction, b.z));
}

vec3 bsdf_world(bsdf b, vec3 local)
{
    return local.x * b.x + local.y * b.y + local.z * b.z;
}

// The share that the boundary reflects and so withholds from scattering, and its mean. Ward's facets do not hide each
// other at grazing angles, so Fresnel's rise there does not fade as it does with GGX's.
float boundary_share(float cosine, float ior, float roughness)
{
#ifdef WARD
    float f0 = square((ior - 1.0) / (ior + 1.0));
    return fresnel_dielectric(cosine * (1.0 - 0.5 * square(roughness * (1.0 - f0))), ior);
#else
    return fresnel_rough_dielectric(cosine, ior, roughness);
#endif
}

float boundary_share_mean(float ior, float roughness)
{
#ifdef WARD
    return fresnel_rough_dielectric_mean(ior, 0.0);
#else
    return fresnel_rough_dielectric_mean(ior, roughness);
#endif
}

// `view`: towards the eye; `parts`: split_light() of the same surface and NoV, which is not 0.
bsdf bsdf_of(surface s, split parts, vec3 view, float NoV, vec3 along, float anisotropy)
{
    bsdf b;
    b.x = along;
    b.y = cross(s.normal, along);
    b.z = s.normal;
    vec3 local = bsdf_local(b, view);
    b.view = normalize(vec3(local.xy, NoV));
    b.alpha = facet_alpha(s.roughness, anisotropy);
    b.rough = b.alpha.x > FACET_ALPHA_MIN;
    b.alpha = max(b.alpha, vec2(FACET_ALPHA_MIN));
    b.leaves = s.inside && s.transmission > 0.0;
    b.eta = b.leaves ? 1.0 / s.ior : s.ior;
    if (!b.leaves)
        parts.scattered = s.base * ((1.0 - s.metallic) * (1.0 - s.transmission) *
                                    (1.0 - boundary_share(NoV, s.ior, s.roughness)));
    float enters_mean = b.leaves ? 1.0 : 1.0 - boundary_share_mean(s.ior, s.roughness);
    b.scattered = parts.scattered * (INVERSE_PI / enters_mean);
    float scattered = max_component(parts.scattered);
    float facets = max_component(parts.mirror) + max_component(parts.refracted);
    facets = facets > 0.0 ? max(facets, LOBE_CHANCE_MIN) : 0.0;
    b.scattered_chance = scattered + facets > 0.0 ? scattered / (scattered + facets) : 1.0;
    b.mirror_chance = max(max_component(parts.mirror), LOBE_CHANCE_MIN) /
                      (max(max_component(parts.mirror), LOBE_CHANCE_MIN) + max_component(parts.refracted));
    return b;
}

// The reflectance and transmittance of a facet.
void facet_parts(bsdf b, surface s, float VoH, out vec3 mirror, out vec3 window)
{
    float dielectric = fresnel_dielectric(VoH, b.eta);
    mirror = mix(vec3(dielectric), fresnel_schlick(s.base, VoH), s.metallic);
    // Glass is tinted once, where light enters it.
    window = (b.leaves ? vec3(1.0) : s.base) * ((1.0 - dielectric) * (1.0 - s.metallic) * s.transmission);
}

// The probability of choosing the mirror over the window. Ward's lobe has other facets than the window, so it is chosen
// before the facet.
float facet_mirror_chance(bsdf b, vec3 mirror, vec3 window)
{
#ifdef WARD
    return b.mirror_chance;
#else
    float size = max_component(mirror), both = size + max_component(window);
    return both > 0.0 ? size / both : 1.0;
#endif
}

// The reflectance from a direction on the same side (unit) to the eye, per steradian, times the cosine; and the
// probability per steradian with which bsdf_choose() samples it. A smooth mirror is left out of both.
vec3 bsdf_evaluate(bsdf b, surface s, vec3 light_world, out float probability)
{
    vec3 light = bsdf_local(b, light_world);
    probability = 0.0;
    if (light.z <= 0.0 || dot(s.geometric, light_world) <= 0.0)
        return vec3(0.0);
    float enters = b.leaves ? 1.0 : 1.0 - boundary_share(light.z, s.ior, s.roughness);
    vec3 sent = b.scattered * (enters * light.z);
    probability = b.scattered_chance * light.z * INVERSE_PI;
    if (!b.rough)
        return sent;
    vec3 facet = normalize(b.view + light), mirror, window;
    float VoH = clamp(dot(b.view, facet), 1e-6, 1.0);
    facet_parts(b, s, VoH, mirror, window);
    float chance = (1.0 - b.scattered_chance) * facet_mirror_chance(b, mirror, window);
#ifdef WARD
    float lobe_density = ward_density(facet, VoH, b.alpha);
    sent += mirror * (ward_weight(b.view, light, facet, VoH) * lobe_density);
#else
    float lobe_density = visible_facet_density(facet, b.view, VoH, b.alpha) / (4.0 * VoH);
    sent += mirror * (facet_both_share(b.view, light, b.alpha) * lobe_density);
#endif
    probability += chance * lobe_density;
    return sent;
}

#define BSDF_SCATTERED 0u
#define BSDF_MIRRORED 1u
#define BSDF_REFRACTED 2u

struct bsdf_choice {
    vec3 direction;    // unit, world space
    vec3 weight;       // of the radiance along it: reflectance times cosine / probability; 0: there is no ray
    float probability; // per steradian; 0: undefined (smooth, or through a window)
    uint lobe;         // BSDF_*
};

// `choice` chooses the lobe and comes back stretched; `u` the direction.
bsdf_choice bsdf_choose(bsdf b, surface s, inout float choice, vec2 u)
{
    bsdf_choice result = bsdf_choice(b.z, vec3(0.0), 0.0, BSDF_SCATTERED);
    bool scattered = choice < b.scattered_chance;
    float first = scattered ? b.scattered_chance : 1.0 - b.scattered_chance;
    choice = min((scattered ? choice : choice - b.scattered_chance) / first, 0.99999994);
    vec3 facet = b.rough ? visible_facet(b.view, b.alpha, u) : vec3(0.0, 0.0, 1.0), mirror, window;
    float VoH = clamp(dot(b.view, facet), 1e-6, 1.0);
    facet_parts(b, s, VoH, mirror, window);
    vec3 bent = refract(-b.view, facet, 1.0 / b.eta);
    if (!b.rough && dot(bsdf_world(b, bent), s.geometric) >= 0.0) { // totally reflected, or a tilted normal sends it back
        mirror += window;
        window = vec3(0.0);
    }
    float chance = facet_mirror_chance(b, mirror, window);
    bool mirrored = choice < chance;
    if (!scattered)
        choice = min((mirrored ? choice : choice - chance) / (mirrored ? chance : 1.0 - chance), 0.99999994);
    vec3 local;
    if (scattered) {
        float sine = sqrt(u.x), phi = TWO_PI * u.y;
        local = vec3(sine * cos(phi), sine * sin(phi), sqrt(1.0 - u.x));
    } else if (mirrored) {
#ifdef WARD
        if (b.rough)
            facet = ward_facet(b.alpha, u);
#endif
        local = reflect(-b.view, facet);
        result.lobe = BSDF_MIRRORED;
    } else {
        local = bent;
        result.lobe = BSDF_REFRACTED;
    }
    result.direction = normalize(bsdf_world(b, local));
    if (result.lobe == BSDF_REFRACTED) {
        bool out_ = dot(result.direction, s.geometric) < 0.0 && dot(local, local) > 0.5;
        float passes = b.rough ? facet_share(vec3(local.xy, -local.z), b.alpha) : 1.0;
        result.weight = out_ && local.z < 0.0 ? window * (passes / (first * (1.0 - chance))) : vec3(0.0);
    } else if (result.lobe == BSDF_MIRRORED && !b.rough) {
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
