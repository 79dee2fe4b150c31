// SPDX-License-Identifier: MIT
// From the intersections of a closest-hit wave to hits: the second half of tracing layered depth cubes, in place of
// trace/surface.comp. A sample's words are copied into the hit; discs, which no cube holds, become hits as for every
// tracer.
//
// Defines: HAS_DISCS as the scene has them; those of common/range.glsl.
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "common/sampled.glsl"
#include "common/surface.glsl"

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // two texels each
layout(binding = UNIT_TRACER_0) uniform usamplerBuffer sample_geometry;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer sample_surfaces;
layout(binding = IMAGE_HITS, rgba32ui) uniform uimageBuffer hits; // three texels each; an intersection is the first

hit surface_sampled(uint sample_index, float distance_, vec3 direction)
{
    uint normal_geometric = texelFetch(sample_geometry, int(sample_index)).y;
    uvec4 words = texelFetch(sample_surfaces, int(sample_index));
    uint flags = HIT_SAMPLED;
    if (dot(direction, unpack_unit(normal_geometric)) > 0.0)
        flags |= HIT_BACK_FACE;
    return hit(distance_, sample_material(words) | flags, HIT_NO_PRIMITIVE, HIT_NO_PRIMITIVE, words, normal_geometric,
               words.y, 0u, 0xffffffffu);
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
        vec3 direction = texelFetch(rays, int(2u * k + 1u)).xyz;
#ifdef HAS_DISCS
        if (intersection.w == HIT_NO_PRIMITIVE)
            h = surface_disc(intersection.z, distance_, texelFetch(rays, int(2u * k)).xyz, direction);
        else
#endif
            h = surface_sampled(intersection.z, distance_, direction);
    }
    imageStore(hits, int(3u * k), uvec4(floatBitsToUint(h.distance), h.material, h.primitive, h.instance));
    imageStore(hits, int(3u * k + 1u), h.uv01_or_sample);
    imageStore(hits, int(3u * k + 2u), uvec4(h.normal_geometric, h.normal_shading, h.tangent, h.colour));
}
