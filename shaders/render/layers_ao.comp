// SPDX-License-Identifier: MIT
// Makes the rays of the layer `ao` for each hit of a slice: those of the integrator `ao` at first hits, so that the two
// agree.
//
// Defines: those of common/material.glsl and render/shade.glsl.

#include "common/occlusion.glsl"
#include "render/shade.glsl"
#include "render/wave.glsl"

uniform uint first_ray, batch_rays; // this batch, of the all_rays of a sample
uniform uint all_rays;
uniform float reach, falloff;       // metres; see common/occlusion.glsl

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
    s.normal = same_hemisphere(s.normal, s.geometric);
    vec3 origin = off_surface(s, h.distance, s.geometric);
    uvec2 seed = path_seed(p);
    for (uint i = 0u; i < batch_rays; i++) {
        uint index = path_sample(p) * all_rays + first_ray + i;
        vec2 u = sequence_pair(seed, SEQUENCE_WAVE + SEQUENCE_LOBE_DIRECTION, index);
        vec3 direction = occlusion_direction(s.geometric, s.normal, u);
        float far = occlusion_reach(reach, falloff, sequence_number(seed, SEQUENCE_WAVE + SEQUENCE_LOBE, index));
        uint place = i * wave.hits.count + j;
        shadow_rays[place] = ray(vec4(origin, 0.0), vec4(direction, far * (1.0 - 4.0 * PATH_OFFSET)));
#ifdef HAS_TIMES
        shadow_times[place] = p.time;
#endif
    }
}
