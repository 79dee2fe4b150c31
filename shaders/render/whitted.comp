// SPDX-License-Identifier: MIT
// What each hit of a wave sends towards the eye, and the rays that it asks for.
//
//   radiance    emission, and a constant ambient term in Whitted's sense: the environment's irradiance, not
//               shadowed but for the occlusion texture
//   shadow rays one to every light, with the light that arrives if nothing is in the way
//   children    straight on (alpha blending), mirrored, refracted
//
// Defines: those of common/material.glsl, common/light.glsl and common/environment.glsl.
//
// Lights beyond the first batch come in further passes with first_light > 0, which make shadow rays alone.

#include "shared/path.h"
#include "shared/ray.h"
#include "common/dispatch.glsl"
#include "common/environment.glsl"
#include "common/light.glsl"
#include "common/material.glsl"
#include "common/rng.glsl"
#include "common/scattering.glsl"

layout(local_size_x = 64) in;

uniform uint hit_count;
uniform uint first_slot; // of the slice
uniform uint first_light, batch_lights;
uniform uint wave_number;
uniform uint last_wave;  // 1: no children

layout(std430, binding = BIND_RAYS) readonly buffer ray_block { ray rays[]; };
layout(std430, binding = BIND_HITS) readonly buffer hit_block { hit hits[]; };
layout(std430, binding = BIND_HIT_LIST) readonly buffer list_block { uint hit_list[]; };
layout(std430, binding = BIND_PATHS) readonly buffer path_block { path paths[]; };
layout(std430, binding = BIND_RADIANCE) writeonly buffer radiance_block { vec4 radiance[]; };
layout(std430, binding = BIND_CHILDREN) writeonly buffer child_block { child children[]; };
layout(std430, binding = BIND_CHILD_COUNTS) buffer count_block { uint child_counts[]; };
layout(std430, binding = BIND_SHADOW_RAYS) writeonly buffer shadow_block { ray shadow_rays[]; };
layout(std430, binding = BIND_LIGHT_SAMPLES) writeonly buffer sample_block { vec4 light_samples[]; };

// A path that carries less than this to its pixel ends: a third of a step of an 8-bit picture.
const float WEIGHT_MIN = 1.0 / 1024.0;
// Rays start this share of their place's coordinates (and of the way to it) off the surface: some hundred times
// what rounding may be off.
const float OFFSET = 1.0 / 65536.0;
const float FAR = 1e30;

uint child_count = 0u;

void add_child(uint j, path parent, surface s, float distance_, vec3 direction, vec3 weight, bool straight)
{
    uint bounces = (parent.flags & PATH_BOUNCES_MASK) + (straight ? 0u : 1u);
    // not >=: what is not a number ends here as well
    if (!(greatest(weight) >= WEIGHT_MIN && dot(direction, direction) > 0.5) || last_wave != 0u ||
        bounces > frame.depth)
        return;
    float offset = OFFSET * max(greatest(abs(s.position)), distance_);
    vec3 side = dot(direction, s.geometric) > 0.0 ? s.geometric : -s.geometric;
    child c;
    c.origin_t_min = vec4(s.position + offset * side, 0.0);
    c.direction_t_max = vec4(direction, FAR);
    c.weight_r = weight.r;
    c.weight_g = weight.g;
    c.weight_b = weight.b;
    c.pixel = parent.pixel;
    c.cone_width = parent.cone_width + parent.cone_spread * distance_;
    c.cone_spread = parent.cone_spread;
    c.flags = bounces | (straight ? parent.flags & PATH_STRAIGHT : 0u);
    c.time = parent.time;
    children[j * CHILDREN_MAX + child_count] = c;
    child_count++;
}

void no_shadow_ray(uint place)
{
    shadow_rays[place] = ray(vec4(0.0), vec4(0.0, 0.0, 1.0, -1.0));
    light_samples[place] = vec4(0.0); // a dead ray meets nothing, and so lets everything through
}

// Returns how many of the batch's shadow rays are alive.
uint ask_for_lights(uint j, path parent, surface s, split parts, vec3 view, float NoV, vec3 weight,
                    float distance_)
{
    uvec2 pixel = pixel_of_slot(first_slot + parent.pixel);
    float offset = OFFSET * max(greatest(abs(s.position)), distance_);
    vec3 origin = s.position + offset * s.geometric;
    uint alive = 0u;
    for (uint i = 0u; i < batch_lights; i++) {
        uint place = i * hit_count + j, index = first_light + i;
        vec2 u = vec2(0.5);
#ifdef HAS_AREA_LIGHTS
        u = random_pair(pixel.y * frame.width + pixel.x, wave_number << 16 ^ index, frame.seed,
                        frame.sample_index);
#endif
        light_sample lamp = light_sample_at(index, origin, u);
        float NoL = dot(s.normal, lamp.direction);
        vec3 arriving = weight * (brdf(s, parts, view, NoV, lamp.direction) * lamp.irradiance * NoL);
        if (!(greatest(arriving) > 0.0)) {
            no_shadow_ray(place);
            continue;
        }
        // Short of the lamp, as a model may have a surface just there.
        shadow_rays[place] = ray(vec4(origin, 0.0), vec4(lamp.direction, lamp.distance_ * (1.0 - 4.0 * OFFSET)));
        light_samples[place] = vec4(arriving, 0.0);
        alive++;
    }
    return alive;
}

void no_lights(uint j)
{
    for (uint i = 0u; i < batch_lights; i++)
        no_shadow_ray(i * hit_count + j);
}

vec3 shade(uint j, path p, surface s, split parts, ray r, float distance_, vec3 weight)
{
    vec3 direction = r.direction_t_max.xyz;
    if (s.unlit)
        return weight * s.base;
    vec3 mirrored = mirror_direction(s, direction);
    vec3 bent = refract(direction, s.normal, s.inside ? s.ior : 1.0 / s.ior);
    // Not so where it is totally reflected, or where a tilted normal would send it back: it is mirrored then.
    bool through = dot(bent, s.geometric) < 0.0;
    vec3 mirror = parts.mirror + (through ? vec3(0.0) : parts.refracted);
    add_child(j, p, s, distance_, mirrored, weight * mirror * parts.mirror_ray, false);
    if (through)
        add_child(j, p, s, distance_, bent, weight * parts.refracted, false);
    vec3 ambient = parts.scattered * environment_irradiance(s.normal) +
                   mirror * (1.0 - parts.mirror_ray) * environment_irradiance(mirrored);
    return weight * (s.emission + s.occlusion * ambient);
}

void main()
{
    uint j = item_index();
    if (j >= hit_count)
        return;
    uint k = hit_list[j];
    path p = paths[k];
    vec3 weight = vec3(p.weight_r, p.weight_g, p.weight_b);
    ray r = rays[k];
    hit h = hits[k];
    bool first = first_light == 0u;
    float width = p.cone_width + p.cone_spread * h.distance;
    surface s = surface_at(h, r.origin_t_min.xyz, r.direction_t_max.xyz, width);
    vec3 view = -r.direction_t_max.xyz;
    float NoV = clamp(dot(s.normal, view), 1e-4, 1.0); // a shading normal may lean away
    split parts = split_light(s, NoV);
    if (first) {
        float seen = (p.flags & PATH_STRAIGHT) != 0u ? p.weight_r * s.alpha : 0.0;
        if (s.alpha < 1.0)
            add_child(j, p, s, h.distance, r.direction_t_max.xyz, weight * (1.0 - s.alpha), true);
        radiance[k] = vec4(shade(j, p, s, parts, r, h.distance, weight * s.alpha), seen);
    }
    uint shadows = 0u;
    if (s.unlit || s.alpha <= 0.0 || (s.inside && s.transmission > 0.0))
        no_lights(j);
    else
        shadows = ask_for_lights(j, p, s, parts, view, NoV, weight * s.alpha, h.distance);
    child_counts[j] = (first ? child_count : child_counts[j]) + (shadows << 2);
}
