// SPDX-License-Identifier: MIT
// The radiance of each hit of a wave towards the eye, and its rays.
//
//   radiance    emission, and a constant ambient term in Whitted's sense: the environment's irradiance, not
//               shadowed but for the occlusion texture
//   shadow rays one to every light, with its unshadowed radiance
//   children    straight on (alpha blending), mirrored, refracted
//
// Defines: those of common/material.glsl, common/light.glsl and common/environment.glsl.
//
// Lights beyond the first batch come in further passes with first_ray > 0, which make shadow rays alone.

#include "common/environment.glsl"
#include "common/scattering.glsl"
#include "render/light_seen.glsl"
#include "render/shade.glsl"
#include "render/wave.glsl"

uniform uint first_ray, batch_rays; // a light each

void add_child_of_weight(uint j, path parent, surface s, float distance_, vec3 direction, vec3 weight, bool straight)
{
    // not `<`: NaN ends here as well
    if (max_component(weight) >= PATH_WEIGHT_MIN)
        add_child(j, parent, s, distance_, direction, weight, straight, rough_solid_angle(s, direction));
}

// Returns the number of the batch's live shadow rays.
uint ask_for_lights(uint j, path parent, surface s, split parts, vec3 view, float NoV, vec3 weight,
                    float distance_)
{
    vec3 origin = off_surface(s, distance_, s.geometric);
#ifdef HAS_AREA_LIGHTS
    uvec2 seed = path_seed(parent);
    uint sample_ = path_sample(parent);
#endif
    uint alive = 0u;
    for (uint i = 0u; i < batch_rays; i++) {
        uint index = first_ray + i;
        vec2 u = vec2(0.5);
#ifdef HAS_AREA_LIGHTS
        u = sequence_pair(seed, SEQUENCE_EVERY_LIGHT + (wave_number << 16 ^ index), sample_);
#endif
        vec3 from = origin;
        light_sample sampled = light_seen(s, distance_, index, u, from);
        vec3 arriving = weight * (reflected(s, parts, view, NoV, sampled.direction) * sampled.irradiance);
        if (add_shadow_ray(i * wave.hits.count + j, parent, from, sampled.direction, sampled.distance_, arriving))
            alive++;
    }
    return alive;
}

void no_lights(uint j)
{
    for (uint i = 0u; i < batch_rays; i++)
        no_shadow_ray(i * wave.hits.count + j);
}

vec3 shade(uint j, path p, surface s, split parts, ray r, float distance_, vec3 weight)
{
    vec3 direction = r.direction_t_max.xyz;
    if (s.unlit)
        return weight * s.base;
    vec3 mirrored = mirror_direction(s, direction);
    vec3 bent = bent_direction(s, index_ratio(s), direction, s.normal, s.normal);
    // If it is totally reflected, or a tilted normal would send it back, it is mirrored.
    bool through = dot(bent, s.geometric) < 0.0;
    vec3 mirror = parts.mirror + (through ? vec3(0.0) : parts.refracted);
    vec3 in_mirror = mirror * parts.mirror_ray;
#ifdef HAS_CLEARCOAT
    float coat_ray = coat_ray_of(s, parts);
    vec3 coat_mirrored = coat_mirror_direction(s, direction);
    // One ray for both mirrors where they are one; over a refracted ray there is no room for two.
    if (through && max_component(parts.refracted) > 0.0 || dot(mirrored, coat_mirrored) > 0.99999)
        in_mirror += coat_ray;
    else
        add_child_of_weight(j, p, s, distance_, coat_mirrored, weight * coat_ray, false);
#endif
    add_child_of_weight(j, p, s, distance_, mirrored, weight * in_mirror, false);
    if (through)
        add_child_of_weight(j, p, s, distance_, bent, weight * parts.refracted, false);
    vec3 ambient = (parts.scattered + parts.again + sheen_of(parts)) * environment_irradiance(s.normal) +
                   mirror * (1.0 - parts.mirror_ray) * environment_irradiance(mirrored);
    ambient += passed_of(parts) * environment_irradiance(-s.normal);
#ifdef HAS_CLEARCOAT
    ambient += (parts.coat.mirrors - coat_ray) * environment_irradiance(coat_mirrored);
#endif
    return weight * (s.emission + s.occlusion * ambient);
}

void main()
{
    uint j = item_index();
    if (j >= wave.hits.count)
        return;
    uint k = hit_list[j];
    path p = path_at(k);
    ray r = ray_at(k);
    hit h = hit_at(k);
    bool first = first_ray == 0u;
    surface s = surface_of_path(p, h, r);
    vec3 view = -r.direction_t_max.xyz, weight = weight_at(p, s, h.distance);
    float NoV = clamp(dot(s.normal, view), 1e-4, 1.0); // a shading normal may lean away
    split parts = split_light(s, view, NoV);
    if (first) {
        float seen = (p.flags & PATH_STRAIGHT) != 0u ? p.weight_r * s.alpha : 0.0;
        if (s.alpha < 1.0)
            add_child_of_weight(j, p, s, h.distance, r.direction_t_max.xyz, weight * (1.0 - s.alpha), true);
        radiance[k] = vec4(shade(j, p, s, parts, r, h.distance, weight * s.alpha), seen);
    }
    uint shadows = 0u;
    if (s.unlit || s.alpha <= 0.0 || in_glass(s))
        no_lights(j);
    else
        shadows = ask_for_lights(j, p, s, parts, view, NoV, weight * s.alpha, h.distance);
    note_children(j, first, shadows);
}
