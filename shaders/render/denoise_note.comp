// SPDX-License-Identifier: MIT
// What guides the denoiser, of the first surface that each ray of a slice met: its albedo, with what it shines itself, by
// which light is divided so that textures are not blurred; its normal and depth.
//
// Defines: those of common/material.glsl.
//          HAS_MOVED some instances have moved since the picture before.

#include "shared/denoise.h"
#include "common/scattering.glsl"
#include "render/shade.glsl"

uniform uint ray_count;

layout(std430, binding = BIND_DENOISE_NOTES) writeonly buffer note_block { vec4 notes[]; };

#ifdef HAS_MOVED
layout(binding = UNIT_DENOISE_MOVED) uniform usamplerBuffer moved;
#endif

void main()
{
    uint k = item_index();
    if (k >= ray_count)
        return;
    hit h = hit_at(k);
    vec4 albedo = vec4(vec3(1.0), DENOISE_LEFT), normal = vec4(0.0);
    if (h.distance >= 0.0) {
        ray r = ray_at(k);
        surface s = surface_of_path(path_at(k), h, r);
        vec3 view = -r.direction_t_max.xyz;
        split parts = split_light(s, view, clamp(dot(s.normal, view), 1e-4, 1.0));
        vec3 scattered = s.unlit ? s.base : parts.scattered + sheen_of(parts) + passed_of(parts);
        vec3 clear_ = s.unlit ? vec3(0.0) : parts.mirror * parts.mirror_ray + parts.refracted + coat_ray_of(s, parts);
        float all = max_component(scattered + clear_);
        float share = all > 0.0 ? max_component(clear_) / all : 0.0;
        albedo = vec4(min(s.base + s.emission, vec3(1e6)), 1.0 - s.alpha * (1.0 - clamp(share, 0.0, 1.0)));
#ifdef HAS_MOVED
        if (h.instance == HIT_NO_PRIMITIVE || texelFetch(moved, int(h.instance)).x != 0u)
            albedo.a += DENOISE_MOVED;
#endif
        vec3 place = r.origin_t_min.xyz + h.distance * r.direction_t_max.xyz;
        normal = vec4(s.normal, -view_from_world_point(place).z);
    }
    notes[DENOISE_NOTE_TEXELS * k] = albedo;
    notes[DENOISE_NOTE_TEXELS * k + 1u] = normal;
}
