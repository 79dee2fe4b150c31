// SPDX-License-Identifier: MIT
// Adds a wave's radiance and the light of its shadow rays to the samples of the slice. The paths of a sample lie side by
// side; the first of them adds for all, in their order, so no two invocations share a sample and the sum is the same
// every time, to the bit. Shadow rays come in batches: each batch is added to its path's radiance, and the last to the
// samples, so their number does not matter. Paths that left the scene get the environment's light here.
// Defines: GREY the mean of a shadow ray's channels counts; GROUND shadow rays change the pixel's coverage, too
// (ground.comp); COVERS the surfaces that cover the pixel are noted (shared/layers.h). Those of left_scene.glsl and
// light_layers.glsl.

#include "shared/path.h"
#include "common/dispatch.glsl"
#include "common/visibility.glsl"
#include "render/finite.glsl"
#include "render/light_layers.glsl"
#include "render/left_scene.glsl"
#include "render/wave.glsl"

layout(local_size_x = 64) in;

uniform uint batch_rays;
uniform uint last_batch;

layout(binding = UNIT_PASS_0) uniform samplerBuffer light_samples; // texels: software GL fetches these faster
layout(std430, binding = BIND_HIT_PLACES) readonly buffer place_block { uint hit_places[]; };
layout(std430, binding = BIND_RADIANCE) buffer radiance_block { vec4 radiance[]; };
layout(std430, binding = BIND_VISIBILITY) readonly buffer visibility_block { uint visibility[]; };
layout(std430, binding = BIND_SLICE_SUMS) buffer sum_block { vec4 slice_sums[]; };

#ifdef COVERS
#include "shared/hit.h"
#include "shared/layers.h"
uniform uint wave_number;
uniform uint sample_count; // samples of the slice
layout(binding = UNIT_SHADE_HITS) uniform usamplerBuffer hits;
layout(std430, binding = BIND_COVERS) writeonly buffer cover_block { uvec4 covers[]; };

// Notes what covers a sample. At most one path of a sample goes straight on. The shadow on a ground covers, but is no
// object.
void note_cover(uint slot, uint k, float share)
{
    uvec4 h = texelFetch(hits, int(3u * k));
    if (share > 0.0 && wave_number < COVERS_MAX && (h.y & HIT_GROUND) == 0u)
        covers[wave_number * sample_count + slot] = uvec4(h.w, h.y, floatBitsToUint(share), 0u);
}
#endif

uint slot_of(uint k)
{
    return texelFetch(paths, int(k) * PATH_TEXELS).w;
}

// Radiance of hit j, with the light that the batch lets through.
vec4 radiance_of_hit(uint k, uint j)
{
    vec4 sum = radiance[k];
    for (uint i = 0u; i < batch_rays; i++) {
        uint place = i * wave.hits.count + j;
        uint through = visibility[place];
        if (through != 0u) {
            vec3 share = transmittance_of(through);
#ifdef GREY
            share = vec3(dot(share, vec3(1.0 / 3.0)));
#endif
#ifdef LIGHT_LAYERS
            vec4 light = texelFetch(light_samples, int(2u * place)), mirrored = texelFetch(light_samples, int(2u * place + 1u));
            add_parts(slot_of(k), light.rgb * share, mirrored.rgb * share, mirrored.w);
#else
            vec4 light = texelFetch(light_samples, int(place));
#endif
            sum.rgb += light.rgb * share;
#ifdef GROUND
            sum.a += light.a * dot(share, vec3(1.0 / 3.0));
#endif
        }
    }
    return sum;
}

vec4 beyond(uint k)
{
    vec3 of_light; // light of the area light that the path hit
    vec4 arrived = radiance_beyond(k, of_light);
#ifdef LIGHT_LAYERS
    path p = path_at(k);
    vec3 rest = arrived.rgb;
#if defined(LIGHT_GROUPS) && defined(HAS_AREA_LIGHTS)
    if (met_number(p) != 0u)
        note_part(p, part_met(p, LIGHT_BEHIND, group_of_light(met_number(p) - 1u)), of_light);
    rest -= of_light;
#endif
    note_part(p, part_met(p, LIGHT_BEHIND, group_of_environment()), rest);
#endif
    return arrived;
}

// Adds to the sample's coverage.
void note_coverage(uint slot, float coverage)
{
#ifdef LIGHT_LAYERS
    if ((light_layers & LAYER_BIT_BACKGROUND) != 0u)
        light_sums[place_in_layer(LAYER_BIT_BACKGROUND, slot)].a = coverage;
#ifdef LIGHT_GROUPS
    uint behind = LAYER_BIT_LIGHT_REST << group_of_environment();
    if ((light_layers & behind) != 0u)
        light_sums[place_in_layer(behind, slot)].a = coverage;
#endif
#endif
}

void main()
{
    uint k = item_index();
    if (k >= wave.rays.count)
        return;
    bool last = last_batch != 0u;
    uint slot = slot_of(k);
    if (last && k > 0u && slot_of(k - 1u) == slot)
        return;
    vec4 sum = slice_sums[slot];
    bool more = true;
    while (more) { // over the sample's paths; a batch that is not the last has one
        uint j = hit_places[k];
        vec4 arrived = vec4(0.0);
        if (j != HIT_PLACE_NONE)
            arrived = radiance_of_hit(k, j);
        else if (last)
            arrived = beyond(k);
#ifdef COVERS
        if (last && j != HIT_PLACE_NONE)
            note_cover(slot, k, arrived.a);
#endif
        if (last)
            sum += finite(arrived);
        else
            radiance[k] = arrived;
        k++;
        more = last && k < wave.rays.count && slot_of(k) == slot;
    }
    if (last) {
        slice_sums[slot] = sum;
        note_coverage(slot, sum.a);
    }
}
