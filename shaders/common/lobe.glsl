// SPDX-License-Identifier: MIT
// One ray for all reflection and refraction of a surface: chooses a visible facet, and whether it reflects or refracts.
//
// Facets are distributed as in brdf(): GGX, each a smooth mirror or window by Fresnel's equations (metal: Schlick),
// with the alpha that glTF has, the square of the roughness. On a smooth surface, the ray's direction and mean weight
// are those of whitted.

#include "common/cone.glsl"
#include "common/facets.glsl"
#include "common/scattering.glsl"

struct lobe {
    vec3 direction;    // unit
    vec3 weight;       // of the radiance along it; 0: there is no ray
    float solid_angle; // 1 / the density with which it was chosen, steradians; 0: the surface is smooth
};

// The lit share of the visible facets. Heitz. Understanding the Masking-Shadowing Function. 2014: height-correlated as
// in V_SmithGGXCorrelated() on the view's side, independent on the other.
float lit_share(float NoV, float NoL, float alpha)
{
    float a2 = alpha * alpha, v = sqrt(a2 + (1.0 - a2) * NoV * NoV), l = sqrt(a2 + (1.0 - a2) * NoL * NoL);
    if (NoL < 0.0)
        return -2.0 * NoL / (l - NoL);
    return NoL * (NoV + v) / max(NoV * l + NoL * v, 1e-7);
}

// `choice` chooses between mirror and window and comes back stretched; `u` chooses the facet.
lobe lobe_choose(surface s, float NoV, vec3 direction, inout float choice, vec2 u)
{
    float alpha = square(s.roughness);
    bool rough = alpha > FACET_ALPHA_MIN;
    vec3 facet = s.normal;
    float facet_angle = 0.0;
    if (rough) {
        vec3 x, y;
        tangent_frame(s.normal, x, y);
        vec3 view = normalize(vec3(-dot(direction, x), -dot(direction, y), NoV));
        vec3 found = visible_facet(view, vec2(alpha), u);
        facet = found.x * x + found.y * y + found.z * s.normal;
        facet_angle = 1.0 / visible_facet_density(found, view, clamp(dot(view, found), 1e-4, 1.0), vec2(alpha));
    }
    bool leaves = s.inside && s.transmission > 0.0;
    float VoH = rough ? clamp(-dot(direction, facet), 1e-4, 1.0) : NoV;
    float dielectric = fresnel_dielectric(VoH, leaves ? 1.0 / s.ior : s.ior);
    vec3 mirror = mix(vec3(dielectric), fresnel_schlick(s.base, VoH), s.metallic);
    // Glass is tinted once, where light enters it.
    vec3 window = (leaves ? vec3(1.0) : s.base) * ((1.0 - dielectric) * (1.0 - s.metallic) * s.transmission);
    vec3 bent = refract(direction, facet, s.inside ? s.ior : 1.0 / s.ior);
    if (dot(bent, s.geometric) >= 0.0) { // totally reflected, or a tilted normal would send it back
        mirror += window;
        window = vec3(0.0);
    }
    float mirror_size = max_component(mirror), both = mirror_size + max_component(window);
    if (!(both > 0.0))
        return lobe(s.normal, vec3(0.0), 0.0);
    float share = mirror_size / both;
    bool mirrored = choice < share;
    choice = min(mirrored ? choice / share : (choice - share) / (1.0 - share), 0.99999994);
    lobe result;
    if (mirrored) {
        vec3 reflected = reflect(direction, facet);
        bool out_ = dot(reflected, s.geometric) > 0.0;
        result.direction = out_ || rough ? reflected : reflect(direction, s.geometric);
        result.weight = out_ || !rough ? mirror / share : vec3(0.0);
    } else {
        result.direction = bent;
        result.weight = window / (1.0 - share);
    }
    result.solid_angle = facet_angle * square(facet_turn(s.inside ? 1.0 / s.ior : s.ior, mirrored));
    if (rough)
        result.weight *= lit_share(NoV, dot(result.direction, s.normal), alpha);
    return result;
}
