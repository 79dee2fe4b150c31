// SPDX-License-Identifier: MIT
// Fills the hits of a slice whose primitives the rasteriser found (as noted by primary.comp).
// Defines: those of common/primary_hit.glsl.

#include "shared/path.h"
#include "shared/ray.h"
#include "shared/hit.h"
#include "common/dispatch.glsl"
#include "common/surface.glsl"
#include "common/primary_hit.glsl"
#include "render/wave.glsl"

layout(local_size_x = 64) in;

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // texels: software GL fetches these faster
layout(std430, binding = BIND_HITS) buffer hit_block { uvec4 hits[]; }; // HIT_TEXELS each
layout(std430, binding = BIND_HIT_LIST) readonly buffer list_block { uint hit_list[]; };

void main()
{
    uint j = item_index();
    if (j >= wave.hits.count)
        return;
    uint k = hit_list[j];
    uvec4 seen = hits[HIT_TEXELS * k];
    uint instance_index = seen.w, primitive = seen.z;
    vec4 origin_t_min = texelFetch(rays, int(2u * k));
    vec3 origin = origin_t_min.xyz, direction = texelFetch(rays, int(2u * k + 1u)).xyz;
    candidate found;
#ifndef NO_DISCS
    if (instance_index == HIT_NO_PRIMITIVE)
        found = candidate_disc(primitive, origin, direction);
    else
#endif
#ifdef HAS_SPHERES
    if (geometry_at(instance_at(instance_index).geometry).kind == GEOMETRY_SPHERES)
        found = candidate_sphere(instance_index, primitive, origin, direction, origin_t_min.w);
    else
#endif
        found = candidate_triangle(instance_index, primitive, origin, direction, 0.0);
    // Two compilations of the same test may round differently at a rim: a hit stays a hit.
    found.distance = max(found.distance, origin_t_min.w);
    hit h = surface_of(found, origin, direction, 0.0);
    hits[HIT_TEXELS * k] = uvec4(floatBitsToUint(h.distance), h.material, h.primitive, h.instance);
    hits[HIT_TEXELS * k + 1u] = h.uv01_or_sample;
    hits[HIT_TEXELS * k + 2u] = uvec4(h.normal_geometric, h.normal_shading, h.tangent, h.colour);
}
