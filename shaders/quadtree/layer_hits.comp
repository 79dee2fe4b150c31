// SPDX-License-Identifier: MIT
// Intersects rays that begin at the eye of a view with the surfaces of one of its layers.
//
// Defines: HAS_SPHERES as the scene has them; those of common/range.glsl.
#include "shared/hit.h"
#include "shared/path.h"
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "common/intersection.glsl"
#include "common/math.glsl"
#include "quadtree/face.glsl"

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // two texels per ray
// Three texels per hit; the first one is the intersection.
layout(binding = IMAGE_HITS, rgba32ui) writeonly uniform uimageBuffer hits;
layout(binding = UNIT_QUADTREE_VISIBLE) uniform usampler2DArray quadtree_visible;
layout(binding = UNIT_QUADTREE_NODES) uniform usamplerBuffer quadtree_nodes;

uniform uint layer;
// 1: of the layers behind the first, the layer'th one that some eye within the radius sees
uniform uint only_within_reach;

uvec2 leaf(uint slice, ivec2 texel)
{
    ivec2 last = ivec2(quadtree.width, quadtree.height) - 1;
    return texelFetch(quadtree_nodes, int(node_index(slice, 0u, uvec2(clamp(texel, ivec2(0), last))))).xy;
}

const uint NO_LAYER = 0xffffffffu;
const int DIRECTIONS = 8;
const vec2 TURN = vec2(cos(TWO_PI / float(DIRECTIONS)), sin(TWO_PI / float(DIRECTIONS)));
const mat2 NEXT_DIRECTION = mat2(TURN, vec2(-TURN.y, TURN.x));
const int DISTANCES = 4;
const float REACH_MAX = 128.0; // texels

// Whether an eye in a direction at the radius sees past the surface that hides another one. Along a ray from the hidden
// surface towards that eye w grows by `growth` per texel, until it meets the plane of the hiding surface. The eye sees
// past that if the ray is before the visible surface somewhere on the way: then there is an edge between. Some places are
// tested: a gap that they miss is narrow.
bool is_seen_past(uint hiding, ivec2 texel, vec2 towards, float w, float growth)
{
    uvec2 hides = leaf(hiding, texel);
    float reach = min((plane_w(hides) - w) / max(growth - dot(plane_slopes(hides), towards), 1e-9), REACH_MAX);
    for (int k = 1; k <= DISTANCES; k++) {
        ivec2 way = ivec2(towards * (reach * float(k) / float(DISTANCES))); // at most the full reach
        float of_ray = w + length(vec2(way)) * growth;
        float of_plane = plane_w(hides) + dot(plane_slopes(hides), vec2(way));
        if (of_ray < of_plane && plane_w(leaf(hiding, texel + way)) < of_ray)
            return true;
    }
    return false;
}

bool is_within_reach(uint hidden, ivec2 texel)
{
    float growth = 1.0 / (quadtree.scale_centre.x * quadtree.bounds.w), w = plane_w(leaf(hidden, texel));
    vec2 towards = vec2(1.0, 0.0);
    for (int i = 0; i < DIRECTIONS && w > 0.0; i++) {
        // Turns by a fixed step: angles would take longer than the texels read along them.
        towards = NEXT_DIRECTION * towards;
        if (is_seen_past(0u, texel, towards, w, growth) && (hidden < 2u || is_seen_past(1u, texel, towards, w, growth)))
            return true;
    }
    return false;
}

// Number of the layer shown. Bodies have two sides: the far side of the visible surface is next behind it, but few eyes
// see that.
uint shown_layer(ivec2 texel)
{
    if (only_within_reach == 0u)
        return layer;
    uint found = 0u;
    for (uint hidden = 1u; hidden < quadtree.layers; hidden++) {
        found += uint(is_within_reach(hidden, texel));
        if (found == layer)
            return hidden;
    }
    return NO_LAYER;
}

// Distance along the ray to the plane of the texel.
float leaf_distance(uint slice, vec3 origin, vec3 direction, uvec2 texel)
{
    float w = plane_w(texelFetch(quadtree_nodes, int(node_index(slice, 0u, texel))).xy);
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
    uint shown = is_inside ? shown_layer(texel) : NO_LAYER;
    uvec2 visible =
        shown != NO_LAYER ? texelFetch(quadtree_visible, ivec3(texel, int(shown)), 0).xy : uvec2(VISIBLE_NOTHING);
    uvec4 intersection = uvec4(floatBitsToUint(-1.0), 0u, HIT_NO_PRIMITIVE, HIT_NO_PRIMITIVE);
    if (visible.x != VISIBLE_NOTHING) {
        float near = leaf_distance(shown, origin, direction, uvec2(texel));
        float distance_ = surface_distance(visible, origin_t_min.xyz, direction_t_max.xyz, near);
        intersection = uvec4(floatBitsToUint(max(distance_, origin_t_min.w)), (shown + 1u) << HIT_LAYER_SHIFT, visible.y,
                             visible.x == VISIBLE_DISC ? HIT_NO_PRIMITIVE : visible.x - 1u);
    }
    imageStore(hits, int(3u * k), intersection);
}
