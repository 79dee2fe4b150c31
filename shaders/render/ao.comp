// SPDX-License-Identifier: MIT
// Makes the ambient occlusion rays of each hit.
//
//   radiance none, only the pixel's coverage
//   shadow rays the frame's number per sample, in batches
//   child       straight on (alpha blending)
//
// The rays of all samples of a pixel, and all rays of a sample, are points of one sequence: they are stratified
// together.
//
// Defines: those of common/material.glsl and render/shade.glsl.

#include "common/occlusion.glsl"
#include "render/shade.glsl"
#include "render/wave.glsl"

uniform uint first_ray, batch_rays; // this batch, of shadow_rays_a_hit
uniform float reach, falloff;       // metres; see common/occlusion.glsl

uint ask_for_openness(uint j, path p, surface s, float weight, float distance_)
{
    uvec2 seed = path_seed(p);
    uint dimension = SEQUENCE_WAVE + wave_number * SEQUENCE_WAVE_SIZE, alive = 0u;
    vec3 origin = off_surface(s, distance_, s.geometric);
    for (uint i = 0u; i < batch_rays; i++) {
        uint index = path_sample(p) * shadow_rays_a_hit + first_ray + i;
        vec3 direction =
            occlusion_direction(s.geometric, s.normal, sequence_pair(seed, dimension + SEQUENCE_LOBE_DIRECTION, index));
        float far = occlusion_reach(reach, falloff, sequence_number(seed, dimension + SEQUENCE_LOBE, index));
        vec3 arriving = vec3(weight / float(shadow_rays_a_hit));
        if (add_shadow_ray(i * wave.hits.count + j, p, origin, direction, far, arriving))
            alive++;
    }
    return alive;
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
    surface s = surface_of_path(p, h, r);
    // Normal and bump maps may tilt the shading normal to the other side.
    s.normal = same_hemisphere(s.normal, s.geometric);
    bool first = first_ray == 0u;
    float weight = p.weight_r * s.alpha, rest = p.weight_r - weight;
    if (first) {
        if (rest >= PATH_WEIGHT_MIN)
            add_child(j, p, s, h.distance, r.direction_t_max.xyz, vec3(rest), true, 0.0);
        radiance[k] = vec4(vec3(0.0), weight);
    }
    note_children(j, first, ask_for_openness(j, p, s, weight, h.distance));
}
