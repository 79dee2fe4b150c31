// SPDX-License-Identifier: MIT
// Turns the intersections of a closest-hit wave into hits: the second half of tracing layered depth cubes, in place of
// trace/surface.comp. A sample's words are copied into the hit, with the normals of its primitive where the ray hits it:
// those at the sample's place are off where facets bend within a cell, most of all on spheres of few cells. Normals from
// maps stay as they were sampled. Discs, which no cube holds, become hits as for every tracer.
//
// Defines: HAS_SPHERES, HAS_DISCS as the scene has them; those of common/range.glsl and common/surface.glsl.
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "common/intersection.glsl"
#include "common/sampled.glsl"
#include "common/surface.glsl"
#include "ldc/layout.h"

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // two texels per ray
layout(binding = UNIT_TRACER_0) uniform usamplerBuffer sample_surfaces;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer sample_primitives;
// Three texels per hit; the first one is the intersection.
layout(binding = IMAGE_HITS, rgba32ui) uniform uimageBuffer hits;

hit surface_sampled(uint sample_index, float distance_, vec3 origin, vec3 direction)
{
    uvec4 words = texelFetch(sample_surfaces, int(sample_index));
    uvec2 which = texelFetch(sample_primitives, int(sample_index)).xy;
    candidate found = candidate(distance_, which.y, which.x & LDC_INSTANCE_MASK, vec2(0.0));
    if ((which.x & LDC_OF_SPHERES) == 0u)
        found.barycentrics = candidate_triangle(found.instance_index, which.y, origin, direction, 0.0).barycentrics;
    hit exact = surface_of(found, origin, direction, 0.0);
    material m = material_at(sample_material(words));
    bool has_map = m.texture_normal != 0u || m.texture_bump != 0u;
    words.y = has_map ? words.y : exact.normal_shading;
    uint flags = HIT_SAMPLED | exact.material & HIT_BACK_FACE;
    return hit(distance_, sample_material(words) | flags, HIT_NO_PRIMITIVE, HIT_NO_PRIMITIVE, words,
               exact.normal_geometric, words.y, 0u, 0xffffffffu);
}

void main()
{
    uint k = first_ray + item_index();
    if (k >= ray_end)
        return;
    uvec4 intersection = imageLoad(hits, int(3u * k));
    float distance_ = uintBitsToFloat(intersection.x);
    hit h = surface_miss();
    if (intersection.z != HIT_NO_PRIMITIVE) {
        vec3 origin = texelFetch(rays, int(2u * k)).xyz, direction = texelFetch(rays, int(2u * k + 1u)).xyz;
#ifdef HAS_DISCS
        if (intersection.w == HIT_NO_PRIMITIVE)
            h = surface_disc(intersection.z, distance_, origin, direction);
        else
#endif
            h = surface_sampled(intersection.z, distance_, origin, direction);
    }
    imageStore(hits, int(3u * k), uvec4(floatBitsToUint(h.distance), h.material, h.primitive, h.instance));
    imageStore(hits, int(3u * k + 1u), h.uv01_or_sample);
    imageStore(hits, int(3u * k + 2u), uvec4(h.normal_geometric, h.normal_shading, h.tangent, h.colour));
}
