// SPDX-License-Identifier: MIT
// Writes the guide of the denoiser from the first surface that each ray of a slice met: its albedo, including its own
// emission, by which light is divided so that textures are not blurred; its normal and depth. The albedo is the share of
// the light from all around that is sent to the eye, with reflections: by its base colour alone, light that a dark colour
// mirrors would get the complement of that colour.
//
// For smooth mirrors and glass the guide is that of the surface seen in or behind them, where most light comes from
// (FOLLOWS, over the rays of a bounce): the albedo is the product, the normal that of the surface seen, the depth that of
// the whole way, as in production (Intel. Open Image Denoise, documentation: following the path to the first surface that
// is not smooth). Samples that went another way count hardly at all.
//
// Defines: those of common/material.glsl.
//          HAS_NOTED_MOTION notes have a third texel. HAS_MOVED with it: some instances have moved since the picture
//          before.
//          FOLLOWS with it: for rays that surfaces have sent on.

#include "shared/denoise.h"
#include "common/camera.glsl"
#include "common/scattering.glsl"
#include "render/shade.glsl"
#include "render/wave.glsl"

uniform uint ray_count;

layout(std430, binding = BIND_DENOISE_NOTES) buffer note_block { vec4 notes[]; };

#ifdef HAS_MOVED
layout(binding = UNIT_DENOISE_MOVED) uniform samplerBuffer moved;
#endif

struct note {
    vec4 albedo, normal, motion; // texels of shared/denoise.h
};

vec3 motion_of(hit h, vec3 place)
{
    vec3 motion = vec3(0.0);
#ifdef HAS_MOVED
    bool there = h.instance != HIT_NO_PRIMITIVE;
    int row = there ? int(h.instance * DENOISE_MOVED_TEXELS) : 0;
    vec4 p = vec4(place, 1.0);
    motion = vec3(dot(texelFetch(moved, row), p), dot(texelFetch(moved, row + 1), p), dot(texelFetch(moved, row + 2), p));
    motion = there ? motion - place : vec3(DENOISE_ANEW);
#endif
    return motion;
}

note note_of(path p, hit h, ray r)
{
    surface s = surface_of_path(p, h, r);
    vec3 view = -r.direction_t_max.xyz;
    split parts = split_light(s, view, clamp(dot(s.normal, view), 1e-4, 1.0));
    vec3 scattered = s.unlit ? s.base : parts.scattered + sheen_of(parts) + passed_of(parts);
    vec3 mirrored = s.unlit ? vec3(0.0) : parts.mirror * parts.mirror_ray + coat_ray_of(s, parts);
    vec3 refracted = s.unlit ? vec3(0.0) : parts.refracted;
    vec3 sent = scattered + refracted + (s.unlit ? vec3(0.0) : parts.mirror + parts.again + coat_ray_of(s, parts));
    float all = max(max_component(scattered + mirrored + refracted), 1e-30);
    float share = clamp(max_component(mirrored + refracted) / all, 0.0, 1.0);
    vec3 place = r.origin_t_min.xyz + h.distance * r.direction_t_max.xyz;
    uint says = DENOISE_SAYS;
#ifdef HAS_NOTED_MOTION
    bool smooth_ = s.roughness < PATH_STEPS_ROUGHNESS / PATH_STEPS;
    bool mirrors = smooth_ && s.alpha * max_component(mirrored) > DENOISE_MOST * all;
    bool passes = s.alpha * (1.0 - (smooth_ ? max_component(refracted) / all : 0.0)) < 1.0 - DENOISE_MOST;
    says |= (mirrors ? DENOISE_MIRRORS : 0u) | (passes ? DENOISE_PASSES : 0u);
#endif
    return note(vec4(min(sent + s.emission, vec3(1e6)), 1.0 - s.alpha * (1.0 - share)),
                vec4(s.normal, -view_from_world_point(place).z), vec4(motion_of(h, place), float(says)));
}

void write(uint sample_slot, note n)
{
    notes[DENOISE_NOTE_TEXELS * sample_slot] = n.albedo;
    notes[DENOISE_NOTE_TEXELS * sample_slot + 1u] = n.normal;
#ifdef HAS_NOTED_MOTION
    notes[DENOISE_NOTE_TEXELS * sample_slot + 2u] = n.motion;
#endif
}

#ifdef FOLLOWS
// Growth of the depth along the ray of the pixel's middle.
float depth_along(path p)
{
    vec3 origin, direction;
    float t_min;
    uvec2 pixel = pixel_of_slot(first_slot + (p.sample_slot >> frame.sample_shift));
    camera_ray_through(vec2(pixel_in_view(pixel)) + 0.5, origin, direction, t_min);
    return dot(direction, world_from_view_vector(vec3(0.0, 0.0, -1.0)));
}

void main()
{
    uint k = item_index();
    if (k >= wave.rays.count)
        return;
    path p = path_at(k);
    ray r = ray_at(k);
    hit h = hit_at(k);
    uint first = DENOISE_NOTE_TEXELS * p.sample_slot;
    note before = note(notes[first], notes[first + 1u], notes[first + 2u]);
    uint says = uint(before.motion.w);
    if ((says & (DENOISE_MIRRORS | DENOISE_PASSES)) == 0u)
        return;
    bool mirrored = dot(r.direction_t_max.xyz, before.normal.xyz) > 0.0;
    bool with_most = (p.flags & PATH_STEP_MASK) == 0u && (says & (mirrored ? DENOISE_MIRRORS : DENOISE_PASSES)) != 0u;
    if (!with_most) {
        notes[first + 2u].w = 0.0;
    } else if (h.distance >= 0.0) {
        note n = note_of(p, h, r);
        n.albedo.rgb = min(before.albedo.rgb * n.albedo.rgb, vec3(1e6));
        n.normal.w = before.normal.w + h.distance * depth_along(p);
        write(p.sample_slot, n);
    }
}
#else
void main()
{
    uint k = item_index();
    if (k >= ray_count)
        return;
    hit h = hit_at(k);
    note n = note(vec4(vec3(1.0), DENOISE_LEFT), vec4(0.0), vec4(vec3(0.0), float(DENOISE_SAYS)));
    if (h.distance >= 0.0)
        n = note_of(path_at(k), h, ray_at(k));
    write(k, n);
}
#endif
