// SPDX-License-Identifier: MIT
// Computes the radiance of each hit of a wave towards the eye, and its rays.
//
//   radiance    emission, and a constant ambient term in Whitted's sense: the environment's irradiance, shadowed by the
//               occlusion texture alone
//   shadow rays one to every light, with its unshadowed radiance
//   children    straight on (alpha blending), mirrored, refracted
//
// Defines: those of common/material.glsl, common/light.glsl and common/environment.glsl; SENDS_NOTHING no surface is
// see-through or smooth enough for a mirror ray: there are no children, whose code is a fifth of all.
//
// Further passes, with first_ray > 0, make the shadow rays of lights beyond the first batch, and nothing else.

#include "common/environment.glsl"
#include "common/scattering.glsl"
#include "render/light_seen.glsl"
#include "render/shade.glsl"
#include "render/wave.glsl"

uniform uint first_ray, batch_rays; // lights, each with a ray

// Children of a hit, in this order. Each has a bit, so that one loop makes all: its code is compiled once, and software
// GL skips it for a group of hits without children.
const uint SENDS_STRAIGHT = 1u, SENDS_COAT = 2u, SENDS_MIRRORED = 4u, SENDS_BENT = 8u;

// Sources of ambient light: one loop for the same reason.
const uint FROM_AROUND = 1u, FROM_MIRRORED = 2u, FROM_BEHIND = 4u, FROM_COAT = 8u;

struct sent {
    uint which;
    vec3 straight, mirrored, bent; // directions
    vec3 straight_weight, mirrored_weight, bent_weight;
#ifdef HAS_CLEARCOAT
    vec3 coat, coat_weight;
#endif
};

uint sends(uint which, vec3 weight)
{
    return max_component(weight) >= PATH_WEIGHT_MIN ? which : 0u; // not `<`: NaN has no child
}

void add_children(uint j, path parent, surface s, float distance_, sent on)
{
    for (; on.which != 0u; on.which &= on.which - 1u) {
        uint which = on.which & -on.which;
        vec3 direction = on.bent, weight = on.bent_weight;
        if (which == SENDS_STRAIGHT) {
            direction = on.straight;
            weight = on.straight_weight;
        } else if (which == SENDS_MIRRORED) {
            direction = on.mirrored;
            weight = on.mirrored_weight;
        }
#ifdef HAS_CLEARCOAT
        if (which == SENDS_COAT) {
            direction = on.coat;
            weight = on.coat_weight;
        }
#endif
        add_child(j, parent, s, distance_, direction, weight, which == SENDS_STRAIGHT, rough_solid_angle(s, direction));
    }
}

// Makes shadow rays to the lights; returns the number of the batch's live ones. `asks`: whether there are any; their
// places are written all the same, here, as each store is code.
uint ask_for_lights(uint j, bool asks, path parent, surface s, split parts, vec3 view, float NoV, vec3 weight,
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
        vec3 from = origin, arriving = vec3(0.0);
        light_sample sampled = light_sample(vec3(0.0), 0.0, vec3(0.0));
        if (asks) {
            vec2 u = vec2(0.5);
#ifdef HAS_AREA_LIGHTS
            u = sequence_pair(seed, SEQUENCE_EVERY_LIGHT + (wave_number << 16 ^ index), sample_);
#endif
            sampled = light_seen(s, distance_, index, u, from);
            vec3 sent = reflected(s, parts, view, NoV, sampled.direction, light_shine(index, s.roughness));
            arriving = weight * (sent * sampled.irradiance);
        }
        if (add_shadow_ray(i * wave.hits.count + j, parent, from, sampled.direction, sampled.distance_, arriving))
            alive++;
    }
    return alive;
}

vec3 shade(surface s, split parts, vec3 direction, vec3 weight, inout sent on)
{
    if (s.unlit)
        return weight * s.base;
    on.mirrored = mirror_direction(s, direction);
    vec3 mirror = parts.mirror;
#ifdef HAS_CLEARCOAT
    float coat_ray = coat_ray_of(s, parts);
    on.coat = coat_mirror_direction(s, direction);
#endif
#ifndef SENDS_NOTHING
    on.bent = bent_direction(s, index_ratio(s), direction, s.normal, s.normal);
    // Light that is totally reflected, or sent back by a tilted normal, is mirrored.
    bool through = dot(on.bent, s.geometric) < 0.0;
    mirror += through ? vec3(0.0) : parts.refracted;
    vec3 in_mirror = mirror * parts.mirror_ray;
#ifdef HAS_CLEARCOAT
    on.coat_weight = weight * coat_ray;
    // Both mirrors share a ray where their directions agree; beside a refracted ray there is no room for two.
    if (through && max_component(parts.refracted) > 0.0 || dot(on.mirrored, on.coat) > 0.99999)
        in_mirror += coat_ray;
    else
        on.which |= sends(SENDS_COAT, on.coat_weight);
#endif
    on.mirrored_weight = weight * in_mirror;
    on.which |= sends(SENDS_MIRRORED, on.mirrored_weight);
    on.bent_weight = weight * parts.refracted;
    if (through)
        on.which |= sends(SENDS_BENT, on.bent_weight);
#endif
    vec3 blurred = mirror * (1.0 - parts.mirror_ray), ambient = vec3(0.0);
    uint from = FROM_AROUND | (max_component(blurred) > 0.0 ? FROM_MIRRORED : 0u);
#ifdef HAS_DIFFUSE_TRANSMISSION
    from |= FROM_BEHIND;
#endif
#ifdef HAS_CLEARCOAT
    from |= FROM_COAT;
#endif
    for (; from != 0u; from &= from - 1u) {
        uint which = from & -from;
        vec3 about = s.normal, share = parts.scattered + parts.again + sheen_of(parts);
        if (which == FROM_MIRRORED) {
            about = on.mirrored;
            share = blurred;
        }
#ifdef HAS_DIFFUSE_TRANSMISSION
        if (which == FROM_BEHIND) {
            about = -s.normal;
            share = passed_of(parts);
        }
#endif
#ifdef HAS_CLEARCOAT
        if (which == FROM_COAT) {
            about = on.coat;
            share = vec3(parts.coat.mirrors - coat_ray);
        }
#endif
        ambient += share * environment_irradiance(about);
    }
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
        sent on;
#ifndef SENDS_NOTHING
        on.straight = r.direction_t_max.xyz;
        on.straight_weight = weight * (1.0 - s.alpha);
        on.which = s.alpha < 1.0 ? sends(SENDS_STRAIGHT, on.straight_weight) : 0u;
#endif
        radiance[k] = vec4(shade(s, parts, r.direction_t_max.xyz, weight * s.alpha, on), seen);
#ifndef SENDS_NOTHING
        add_children(j, p, s, h.distance, on);
#endif
    }
    bool asks = !(s.unlit || s.alpha <= 0.0 || in_glass(s));
    uint shadows = ask_for_lights(j, asks, p, s, parts, view, NoV, weight * s.alpha, h.distance);
    note_children(j, first, shadows);
}
