// SPDX-License-Identifier: MIT
// Writes the layers of each sample of a slice: those of the first surface that its ray hit, opaque or not. They are 0 for
// a sample that hit nothing, and, in layers of the first sample only, for all others.
//
// Defines: NEEDS_SURFACE albedo or normal are among them; those of common/material.glsl.

#include "shared/layers.h"
#include "common/camera.glsl"
#include "render/shade.glsl"

uniform uint ray_count;
uniform uint layers; // layers of the frame, without the beauty
uniform uint noting; // layers that are written
uniform uint first_light_plane, end_light_plane; // layers of light, to which the integrator adds

layout(std430, binding = BIND_LAYER_SUMS) writeonly buffer layer_block { vec4 layer_sums[]; };

void put(uint layer_bit, uint k, vec4 value)
{
    uint plane = uint(bitCount(layers & ~LAYER_BITS_CRYPTO & layer_bit - 1u));
    if ((noting & layer_bit) != 0u)
        layer_sums[plane * ray_count + k] = value;
}

uint node_of(hit h)
{
    // Discs belong to no node; a stored sample does not hold its node.
    return h.instance == HIT_NO_PRIMITIVE ? 0u : instance_at(h.instance).node;
}

void main()
{
    uint k = item_index();
    if (k >= ray_count)
        return;
    for (uint plane = first_light_plane; plane < end_light_plane; plane++)
        layer_sums[plane * ray_count + k] = vec4(0.0);
    hit h = hit_at(k);
    // Later waves are in layers_unknown.comp, and pictures from a key view in gather_views.comp.
    put(LAYER_BIT_UNKNOWN, k, vec4(vec3((h.material & HIT_UNKNOWN) != 0u ? 1.0 : 0.0), 1.0));
    if (!(h.distance >= 0.0)) {
        for (uint layer_bit = LAYER_BIT_ALBEDO; layer_bit <= LAYER_BIT_ID; layer_bit <<= 1)
            put(layer_bit, k, vec4(0.0));
        return;
    }
    path p = path_at(k);
    ray r = ray_at(k);
    vec3 place = r.origin_t_min.xyz + h.distance * r.direction_t_max.xyz;
#ifdef NEEDS_SURFACE
    surface s = surface_of_path(p, h, r);
    put(LAYER_BIT_ALBEDO, k, vec4(s.base, 1.0));
    put(LAYER_BIT_NORMAL, k, vec4(s.normal, 1.0));
#endif
    vec4 depth = vec4(0.0), position = vec4(0.0), id = vec4(0.0);
    if (path_sample(p) == 0u) {
        depth = vec4(vec3(-view_from_world_point(place).z), 1.0);
        position = vec4(place, 1.0);
        id = vec4(node_of(h), material_at(h.material & HIT_MATERIAL_MASK).id, 0.0, 1.0);
    }
    put(LAYER_BIT_DEPTH, k, depth);
    put(LAYER_BIT_POSITION, k, position);
    put(LAYER_BIT_AO, k, vec4(vec3(0.0), 1.0)); // layers_gather.comp adds to it
    put(LAYER_BIT_ID, k, id);
}
