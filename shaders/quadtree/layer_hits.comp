// SPDX-License-Identifier: MIT
// Rays that begin at the eye of a view: what one of its layers shows where they pass, as intersections.
//
// Defines: HAS_SPHERES as the scene has them; those of common/range.glsl.
#include "shared/hit.h"
#include "shared/path.h"
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "common/intersection.glsl"
#include "quadtree/face.glsl"

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // two texels each
layout(binding = IMAGE_HITS, rgba32ui) writeonly uniform uimageBuffer hits; // three texels each; an intersection is the first
layout(binding = UNIT_QUADTREE_VISIBLE) uniform usampler2DArray quadtree_visible;
layout(binding = UNIT_QUADTREE_NODES) uniform usamplerBuffer quadtree_nodes;

uniform uint layer;

// How far along the ray the plane of the texel is.
float leaf_distance(vec3 origin, vec3 direction, uvec2 texel)
{
    float w = plane_w(texelFetch(quadtree_nodes, int(node_index(layer, 0u, texel))).xy);
    float z = is_orthographic() ? quadtree.depths.y - w * (quadtree.depths.y - quadtree.depths.x) : quadtree.depths.x / w;
    return (z - origin.z) / direction.z;
}

float surface_distance(uvec2 visible, vec3 origin, vec3 direction, float near)
{
    if (visible.x == VISIBLE_DISC) {
        disc d = disc_at(visible.y);
        return dot(d.centre_radius.xyz - origin, d.normal.xyz) / dot(d.normal.xyz, direction);
    }
#ifdef HAS_SPHERES
    instance i = instance_at(visible.x - 1u);
    if (geometry_at(i.geometry).kind == GEOMETRY_SPHERES) {
        vec4 sphere = texelFetch(spheres, int(visible.y));
        vec2 distances;
        if (!intersect_sphere(affine_point(i.object_from_world, origin), affine_vector(i.object_from_world, direction),
                              sphere.xyz, sphere.w, distances))
            return near;
        return abs(distances.x - near) < abs(distances.y - near) ? distances.x : distances.y;
    }
#endif
    return candidate_triangle(visible.x - 1u, visible.y, origin, direction, 0.0).distance;
}

void main()
{
    uint k = first_ray + item_index();
    if (k >= ray_end)
        return;
    vec4 origin_t_min = texelFetch(rays, int(2u * k)), direction_t_max = texelFetch(rays, int(2u * k + 1u));
    vec3 origin = face_vector(0u, origin_t_min.xyz - quadtree.eye_world.xyz);
    vec3 direction = face_vector(0u, direction_t_max.xyz), point = origin + direction;
    ivec2 texel = ivec2(floor(face_place(point, face_q(point)).xy));
    bool is_inside = all(greaterThanEqual(texel, ivec2(0))) &&
                     all(lessThan(texel, ivec2(quadtree.width, quadtree.height))) && direction_t_max.w > origin_t_min.w;
    uvec2 visible = is_inside ? texelFetch(quadtree_visible, ivec3(texel, layer), 0).xy : uvec2(VISIBLE_NOTHING);
    uvec4 intersection = uvec4(floatBitsToUint(-1.0), 0u, HIT_NO_PRIMITIVE, HIT_NO_PRIMITIVE);
    if (visible.x != VISIBLE_NOTHING) {
        float near = leaf_distance(origin, direction, uvec2(texel));
        float distance_ = surface_distance(visible, origin_t_min.xyz, direction_t_max.xyz, near);
        intersection = uvec4(floatBitsToUint(max(distance_, origin_t_min.w)), (layer + 1u) << HIT_LAYER_SHIFT, visible.y,
                             visible.x == VISIBLE_DISC ? HIT_NO_PRIMITIVE : visible.x - 1u);
    }
    imageStore(hits, int(3u * k), intersection);
}
