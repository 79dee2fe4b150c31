// SPDX-License-Identifier: MIT
// One ray for all reflection and refraction of a surface: chooses a visible facet, and whether it reflects or refracts.
//
// Facets are distributed as in brdf(): GGX, each a smooth mirror or window by Fresnel's equations (metal: Schlick),
// with the alpha that glTF has, the square of the roughness. On a smooth surface, the ray's direction and mean weight
// are those of whitted.
//
// What a facet would mirror into another one: metal mirrors it again, as in brdf(); glass lets it through at the first
// facet, or, from inside, keeps it as the flat surface would. So glass loses no light at any roughness, and needs no
// table of what single facets lose.

#include "common/cone.glsl"
#include "common/facets.glsl"
#include "common/scattering.glsl"

struct lobe {
    vec3 direction;    // unit
    vec3 weight;       // of the radiance along it; 0: there is no ray
    float solid_angle; // 1 / the density with which it was chosen, steradians; 0: the surface is smooth
    vec3 scattered;    // of split_light(), of the facet where glass is seen from inside
};

// The lit share of the visible facets, both correlated by height as in V_SmithGGXCorrelated(). 0 below the horizon.
float lit_share(float NoV, float NoL, float alpha)
{
    float a2 = alpha * alpha, v = sqrt(a2 + (1.0 - a2) * NoV * NoV), l = sqrt(a2 + (1.0 - a2) * NoL * NoL);
    return max(NoL, 0.0) * (NoV + v) / max(NoV * l + max(NoL, 0.0) * v, 1e-7);
}

// A direction by its cosine to the normal, from one number: its upper bits and its lower ones.
vec3 again_direction(vec3 normal, float number)
{
    vec3 x, y;
    tangent_frame(normal, x, y);
    float sine = sqrt(number), phi = TWO_PI * fract(number * 4096.0);
    return sine * (cos(phi) * x + sin(phi) * y) + sqrt(1.0 - number) * normal;
}

// What of the light along a direction comes out mirrored more than once, as brdf() has it, by that of all directions.
float again_share(split parts, float cosine, float alpha)
{
    return facets_lost(stretched_cosine(cosine, alpha), alpha) / max(parts.again_mean, 1e-9);
}

// A facet of a rough surface that is seen along the direction. `angle`: 1 / the density with which it was chosen.
vec3 facet_seen(surface s, float NoV, vec3 direction, vec2 u, out float angle)
{
    vec2 alpha = vec2(square(s.roughness));
    vec3 x, y;
    tangent_frame(s.normal, x, y);
    vec3 view = normalize(vec3(-dot(direction, x), -dot(direction, y), NoV));
    vec3 facet = visible_facet(view, alpha, u);
    angle = 1.0 / visible_facet_density(facet, view, clamp(dot(view, facet), 1e-4, 1.0), alpha);
    return facet.x * x + facet.y * y + facet.z * s.normal;
}

// Where the flat surface would send what a facet sends into another one. `side`: the unit normal of the right side.
vec3 turned_to(vec3 direction, vec3 side)
{
    return direction - 2.0 * min(dot(direction, side), 0.0) * side;
}

// `parts`: split_light() of the same surface and NoV. `choice` chooses between mirror, window and several mirrors in
// turn, and comes back stretched; `u` chooses the facet.
lobe lobe_choose(surface s, split parts, float NoV, vec3 direction, inout float choice, vec2 u)
{
    float alpha = square(s.roughness);
    bool rough = alpha > FACET_ALPHA_MIN, leaves = s.inside && s.transmission > 0.0;
    vec3 facet = s.normal;
    float facet_angle = 0.0;
    if (rough)
        facet = facet_seen(s, NoV, direction, u, facet_angle);
    float VoH = rough ? clamp(-dot(direction, facet), 1e-4, 1.0) : NoV;
    float dielectric = fresnel_dielectric(VoH, leaves ? 1.0 / s.ior : s.ior), lit = 1.0;
    vec3 reflected = reflect(direction, facet);
    vec3 bent = refract(direction, facet, s.inside ? s.ior : 1.0 / s.ior);
    if (rough && leaves) {
        reflected = turned_to(reflected, s.normal);
        bent = turned_to(bent, -s.normal);
    } else if (rough) {
        lit = lit_share(NoV, dot(reflected, s.normal), alpha);
    }
    vec3 mirror = mix(vec3(dielectric), fresnel_schlick(s.base, VoH), s.metallic) * lit;
    vec3 again = metal_again(s.base, parts.again_mean) * (s.metallic * (1.0 - lit));
    // Glass is tinted once, where light enters it.
    float enters = (1.0 - dielectric * lit) * (1.0 - s.metallic);
    vec3 window = (leaves ? vec3(1.0) : s.base) * (enters * s.transmission);
    if (dot(bent, s.geometric) >= 0.0) { // totally reflected, or a tilted normal would send it back
        mirror += window;
        window = vec3(0.0);
    }
    vec3 scattered = leaves ? s.base * (enters * (1.0 - s.transmission)) : parts.scattered;
    lobe result = lobe(s.normal, vec3(0.0), 0.0, scattered);
    float mirror_size = max_component(mirror), again_size = max_component(again);
    float all_ = mirror_size + again_size + max_component(window);
    if (!(all_ > 0.0))
        return result;
    float first = mirror_size / all_, second = again_size / all_;
    bool mirrored = choice < first, is_again = !mirrored && choice < first + second;
    float before = mirrored ? 0.0 : is_again ? first : first + second;
    float chance = mirrored ? first : is_again ? second : 1.0 - first - second;
    choice = clamp((choice - before) / chance, 0.0, 0.99999994);
    bool back = mirrored || is_again;
    result.direction = mirrored ? reflected : is_again ? again_direction(s.normal, choice) : bent;
    result.weight = (mirrored ? mirror : is_again ? again : window) / chance;
    float cosine = dot(result.direction, s.normal);
    if (is_again)
        result.weight *= again_share(parts, cosine, alpha);
    if (back && !(dot(result.direction, s.geometric) > 0.0)) {
        result.weight = rough ? vec3(0.0) : result.weight;
        result.direction = reflect(direction, s.geometric);
    }
    float turned = facet_angle * square(facet_turn(s.inside ? 1.0 / s.ior : s.ior, mirrored));
    result.solid_angle = is_again ? PI / max(cosine, 1e-3) : turned;
    return result;
}
