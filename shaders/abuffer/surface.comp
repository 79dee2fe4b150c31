// SPDX-License-Identifier: MIT
// Turns the intersections of a closest-hit wave into hits: the second half of A-buffer tracing, in place of
// trace/surface.comp. A hit is on the sample's own primitive, at its point nearest to the intersection.
//
// Defines: HAS_SPHERES, HAS_DISCS as the scene has them; those of common/range.glsl.
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "common/surface.glsl"
#include "abuffer/sample_primitive.glsl"

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // two texels per ray
// Three texels per hit; the first one is the intersection.
layout(binding = IMAGE_HITS, rgba32ui) uniform uimageBuffer hits;

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
        {
            candidate found = candidate_of_sample(int(intersection.z), distance_);
            found.barycentrics = nearest_barycentrics(found, origin, direction);
            h = surface_of(found, origin, direction, 0.0);
        }
    }
    imageStore(hits, int(3u * k), uvec4(floatBitsToUint(h.distance), h.material, h.primitive, h.instance));
    imageStore(hits, int(3u * k + 1u), h.uv01_or_sample);
    imageStore(hits, int(3u * k + 2u), uvec4(h.normal_geometric, h.normal_shading, h.tangent, h.colour));
}
