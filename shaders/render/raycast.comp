// SPDX-License-Identifier: MIT
// Blends all surfaces along a ray front to back: Levoy. Display of Surfaces from Volume Data. 1988, with surfaces for
// samples. Contributions of each hit of a wave:
//
//   radiance    emission, the light of every source without shadows, and the environment's irradiance, also in place of a
//               mirror's reflection; times the opacity of the surface
//   child       straight on, with the remaining weight
//
// The opacity of blended surfaces is alpha, that of glass the share that it does not transmit; glass tints light as it
// tints shadow rays. All other surfaces are made translucent: `layer_opacity`.
//
// Defines: those of common/material.glsl, common/light.glsl and common/environment.glsl.

#include "common/environment.glsl"
#include "common/scattering.glsl"
#include "render/light_seen.glsl"
#include "render/shade.glsl"
#include "render/wave.glsl"

uniform float layer_opacity; // 0..1

vec3 lit(path p, surface s, vec3 direction, float distance_)
{
    vec3 view = -direction;
    float NoV = clamp(dot(s.normal, view), 1e-4, 1.0); // a shading normal may lean away
    split parts = split_light(s, view, NoV);
    vec3 origin = off_surface(s, distance_, s.geometric);
    vec3 mirror = parts.mirror + parts.refracted; // the scene counts as equally bright behind glass and before it
    vec3 scattered = parts.scattered + parts.again + sheen_of(parts);
    vec3 sum = s.emission + s.occlusion * (scattered * environment_irradiance(s.normal) +
                                           passed_of(parts) * environment_irradiance(-s.normal) +
                                           mirror * environment_irradiance(mirror_direction(s, direction)));
#ifdef HAS_CLEARCOAT
    sum += s.occlusion * parts.coat.mirrors * environment_irradiance(coat_mirror_direction(s, direction));
#endif
    if (in_glass(s))
        return sum; // glass samples no lights from inside
#ifdef HAS_AREA_LIGHTS
    uvec2 seed = path_seed(p);
    uint sample_ = path_sample(p);
#endif
    for (uint i = 0u; i < frame.light_count; i++) {
        vec2 u = vec2(0.5);
#ifdef HAS_AREA_LIGHTS
        u = sequence_pair(seed, SEQUENCE_EVERY_LIGHT + (wave_number << 16 ^ i), sample_);
#endif
        light_sample sampled = light_sample_at(i, origin, u);
        sum += reflected(s, parts, view, NoV, sampled.direction, light_shine(i, s.roughness)) * sampled.irradiance;
    }
    return sum;
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
    vec3 direction = r.direction_t_max.xyz;
    surface s = surface_of_path(p, h, r);
    float transmission = s.transmission * (1.0 - s.metallic), opacity = s.alpha * (1.0 - transmission);
    vec3 through = mix(vec3(1.0), transmission * s.base, s.alpha);
    if ((material_at(h.material & HIT_MATERIAL_MASK).flags & MATERIAL_ALPHA_BLEND) == 0u && transmission == 0.0) {
        opacity = layer_opacity;
        through = vec3(1.0 - layer_opacity);
    }
    vec3 rest = weight * through;
    bool continues = max_component(rest) >= PATH_WEIGHT_MIN; // false for NaN
    if (continues)
        add_child(j, p, s, h.distance, direction, rest, true, 0.0);
    radiance[k] = vec4(weight * opacity * (s.unlit ? s.base : lit(p, s, direction, h.distance)),
                       continues ? weight.r - rest.r : weight.r);
    note_children(j, true, 0u);
}
