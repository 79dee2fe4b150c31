// SPDX-License-Identifier: MIT
// The radiance of each hit of a wave towards the eye, and its rays: Cook, Porter, Carpenter. Distributed Ray Tracing.
// 1984. Of each kind of ray that a hit could emit one is chosen, weighted by the inverse of its probability, so the
// mean of the samples is right however few rays each has.
//
//   radiance    emission, and a constant ambient term as in whitted.comp
//   shadow ray  one, to one point of one light or emissive triangle
//   child       at most one: straight on (alpha blending), mirrored or refracted, in a direction that a facet of the
//               rough surface sends it, or several in turn
//
// Emissive triangles are asked for the light that is scattered alone: what a surface mirrors or refracts of them its
// children see, however rough it is.
//
// Defines: those of common/material.glsl, common/light.glsl, common/environment.glsl and render/shade.glsl; HAS_EMITTERS
// there are emissive triangles that are sampled, and those of common/emitter.glsl.

#include "common/emitter.glsl"
#include "common/environment.glsl"
#include "common/light_choice.glsl"
#include "common/lobe.glsl"
#include "render/shade.glsl"
#include "render/wave.glsl"

// A child with a lower weight than this is traced with the probability weight / this, and then has this weight.
const float ROULETTE = 1.0 / 4.0;

// The roughness of the mirrors and windows that a path has met: they blur what it sees. A light's highlight on a smooth
// surface, which is as bright as it is narrow, is widened to it; else one ray in thousands would hit it, as a firefly.
// Kaplanyan, Dachsbacher. Path Space Regularization for Holistic and Robust Light Transport. 2013.
float path_roughness(path p)
{
    return float(p.flags >> PATH_ROUGHNESS_SHIFT) / 65535.0;
}

void add_lobe(uint j, path p, surface s, float distance_, lobe chosen, vec3 weight, float choice)
{
    vec3 carried = weight * chosen.weight;
    float survival = max_component(carried) / ROULETTE;
    if (!(choice < survival)) // also if it is NaN
        return;
    uint roughness = uint(max(path_roughness(p), s.roughness) * 65535.0 + 0.5);
    p.flags = p.flags & (1u << PATH_ROUGHNESS_SHIFT) - 1u | roughness << PATH_ROUGHNESS_SHIFT;
    add_child(j, p, s, distance_, chosen.direction, carried / min(survival, 1.0), false,
              sample_solid_angle(chosen.solid_angle));
}

#ifdef HAS_EMITTERS
bool ask_for_emitter(uint j, path p, surface s, split parts, vec3 weight, vec3 origin, float chance, vec2 u)
{
    emitter_sample sampled = emitter_sample_at(origin, s.normal, u, p.time);
    float NoL = dot(s.normal, sampled.direction);
    vec3 arriving = vec3(0.0);
    if (sampled.probability > 0.0 && NoL > 0.0 && dot(s.geometric, sampled.direction) > 0.0)
        arriving = weight * brdf_scattered(s, parts, NoL) * sampled.radiance * (NoL / (sampled.probability * chance));
    return add_shadow_ray(j, p, origin, sampled.direction, sampled.distance_, arriving);
}
#endif

bool ask_for_light(uint j, path p, surface s, split parts, vec3 view, float NoV, vec3 weight, float distance_, vec2 u)
{
    vec3 origin = off_surface(s, distance_, s.geometric);
    float probability, all_lights;
    surface blurred = s;
    blurred.roughness = max(s.roughness, path_roughness(p));
    split blurred_parts = split_light(blurred, NoV);
    light_receiver receiver = light_receiver_of(blurred, blurred_parts, origin, view, NoV);
    uint index = light_choose(receiver, frame.light_count, u.x, probability, all_lights);
#ifdef HAS_EMITTERS
    receiver.scattered = max_component(parts.scattered) * INVERSE_PI;
    receiver.mirrored = 0.0;
    float lights_chance = lights_share(receiver, all_lights, emitter_estimate(origin, s.normal));
    if (u.x >= lights_chance) {
        u.x = min((u.x - lights_chance) / (1.0 - lights_chance), 0.99999994);
        return ask_for_emitter(j, p, s, parts, weight, origin, 1.0 - lights_chance, u);
    }
    u.x = min(u.x / lights_chance, 0.99999994);
    probability *= lights_chance;
#endif
    if (probability <= 0.0) {
        no_shadow_ray(j);
        return false;
    }
    light_sample sampled = light_sample_at(index, origin, u);
    float NoL = dot(s.normal, sampled.direction);
    vec3 sent = brdf(blurred, blurred_parts, view, NoV, sampled.direction);
    vec3 arriving = weight * (sent * sampled.irradiance * (NoL / probability));
    return add_shadow_ray(j, p, origin, sampled.direction, sampled.distance_, arriving);
}

void main()
{
    uint j = item_index();
    if (j >= wave.hits.count)
        return;
    uint k = hit_list[j];
    path p = path_at(k);
    vec3 weight = vec3(p.weight_r, p.weight_g, p.weight_b);
    ray r = ray_at(k);
    hit h = hit_at(k);
    vec3 direction = r.direction_t_max.xyz, view = -direction;
    surface s = surface_of_path(p, h, r);
    float NoV = clamp(dot(s.normal, view), 1e-4, 1.0); // a shading normal may lean away
    uvec2 seed = path_seed(p);
    uint index = path_sample(p), dimension = SEQUENCE_WAVE + wave_number * SEQUENCE_WAVE_SIZE;
    float choice = sequence_number(seed, dimension + SEQUENCE_LOBE, index);
    vec3 sent = vec3(0.0);
    bool straight = choice >= s.alpha, asked = false;
    if (straight) {
        add_child(j, p, s, h.distance, direction, weight, true, 0.0);
        no_shadow_ray(j);
    } else if (s.unlit) {
        sent = s.base;
        no_shadow_ray(j);
    } else {
        choice = min(choice / s.alpha, 0.99999994);
        split parts = split_light(s, NoV);
        lobe chosen = lobe_choose(s, parts, NoV, direction, choice,
                                  sequence_pair(seed, dimension + SEQUENCE_LOBE_DIRECTION, index));
        sent = s.emission + s.occlusion * chosen.scattered * environment_irradiance(s.normal);
        add_lobe(j, p, s, h.distance, chosen, weight, choice);
        if (s.inside && s.transmission > 0.0)
            no_shadow_ray(j);
        else
            asked = ask_for_light(j, p, s, parts, view, NoV, weight, h.distance,
                                  sequence_pair_sorted(seed, dimension + SEQUENCE_LIGHT, index, frame.group_shift));
    }
    bool seen = !straight && (p.flags & PATH_STRAIGHT) != 0u;
    radiance[k] = vec4(weight * sent, seen ? p.weight_r : 0.0);
    note_children(j, true, asked ? 1u : 0u);
}
