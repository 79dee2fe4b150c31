// SPDX-License-Identifier: MIT
// Turns the intersections of a closest-hit wave into hits: the second half of every exact tracer. It is separate from the
// traversal, whose program stays small, and which need not keep barycentrics.
//
// Defines: HAS_SPHERES, HAS_MOTION as the scene has them; those of common/range.glsl and common/surface.glsl.
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "common/intersection.glsl"
#include "common/surface.glsl"

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // two texels per ray
#ifdef HAS_MOTION
layout(binding = UNIT_RAY_TIMES) uniform samplerBuffer ray_times;
#endif
// Three texels per hit; the first one is the intersection.
layout(binding = IMAGE_HITS, rgba32ui) uniform uimageBuffer hits;

bool is_triangle(candidate found)
{
    if (found.primitive == HIT_NO_PRIMITIVE || found.instance_index == HIT_NO_PRIMITIVE)
        return false;
#ifdef HAS_SPHERES
    return geometry_at(instance_at(found.instance_index).geometry).kind != GEOMETRY_SPHERES;
#else
    return true;
#endif
}

void main()
{
    uint k = first_ray + item_index();
    if (k >= ray_end)
        return;
    uvec4 intersection = imageLoad(hits, int(3u * k));
    vec3 origin = texelFetch(rays, int(2u * k)).xyz, direction = texelFetch(rays, int(2u * k + 1u)).xyz;
    float time = 0.0;
#ifdef HAS_MOTION
    time = texelFetch(ray_times, int(k)).x;
#endif
    candidate found = candidate(uintBitsToFloat(intersection.x), intersection.z, intersection.w, vec2(0.0));
    if (is_triangle(found))
        found.barycentrics =
            candidate_triangle(found.instance_index, found.primitive, origin, direction, time).barycentrics;
    hit h = surface_of(found, origin, direction, time);
    // Bits of a tracer over a view's visible surfaces, else 0.
    uint known = intersection.y & (HIT_UNKNOWN | HIT_LAYER_MASK);
    imageStore(hits, int(3u * k), uvec4(floatBitsToUint(h.distance), h.material | known, h.primitive, h.instance));
    imageStore(hits, int(3u * k + 1u), h.uv01_or_sample);
    imageStore(hits, int(3u * k + 2u), uvec4(h.normal_geometric, h.normal_shading, h.tangent, h.colour));
}
