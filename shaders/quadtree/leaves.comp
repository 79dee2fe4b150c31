// SPDX-License-Identifier: MIT
// The leaves of one slice: at each texel the plane of the primitive that is seen there, in (x, y, w), from the primitive
// itself and not from differences of depths (section 3.2 of the paper, "g-buffer normals"). nodes.comp writes them to the
// tree, with their flags. An invocation makes a leaf.
//
// Defines: HAS_SPHERES, HAS_DISCS as the scene has them; HAS_CUTOUT if spheres may have holes.
#include "shared/path.h"
#include "common/alpha.glsl"
#include "common/dispatch.glsl"
#include "common/geometry.glsl"
#include "common/intersect.glsl"
#include "common/math.glsl"
#include "quadtree/node.glsl"

layout(binding = UNIT_QUADTREE_VISIBLE) uniform usampler2DArray visible;
layout(binding = UNIT_QUADTREE_NODES) uniform usamplerBuffer nodes;
layout(binding = IMAGE_QUADTREE_PLANES, rg32ui) writeonly uniform uimageBuffer planes;

uniform uint first_item; // of the dispatch
uniform uint slice;
uniform uint layer; // of the face; its slice comes just behind that of the layer before

// What a depth that a node has is rounded by, as a share of it.
const float BEHIND_SHARE = 3.8147e-6; // 2^-18
// The plane of a sliver is uncertain. Where it leaves the sliver's depths by more than this share of w it is none.
const float PLANE_SHARE = 0.001953125; // 2^-9

// Along the axes of the face from the eye.
vec3 face_vector(vec3 world)
{
    uint row = 3u * (slice / quadtree.layers);
    return vec3(dot(quadtree.face_from_world[row].xyz, world), dot(quadtree.face_from_world[row + 1u].xyz, world),
                dot(quadtree.face_from_world[row + 2u].xyz, world));
}

bool is_orthographic()
{
    return quadtree.depths.z != 0.0;
}

// What is seen along the middle of a texel: the points `begin` + Z * `step` of the face.
struct sight_line {
    vec3 begin, step;
};

sight_line sight_line_of(uvec2 place)
{
    vec2 across = (vec2(place) + 0.5 - quadtree.scale_centre.zw) / quadtree.scale_centre.xy;
    return is_orthographic() ? sight_line(vec3(across, 0.0), vec3(0.0, 0.0, 1.0))
                             : sight_line(vec3(0.0), vec3(across, 1.0));
}

float w_of(float z)
{
    return is_orthographic() ? (quadtree.depths.y - z) / (quadtree.depths.y - quadtree.depths.x)
                             : quadtree.depths.x / max(z, quadtree.depths.w);
}

float z_of(float w)
{
    return is_orthographic() ? quadtree.depths.y - w * (quadtree.depths.y - quadtree.depths.x) : quadtree.depths.x / w;
}

// The plane with this normal through a point of it, where the surface has depths between z_min and z_max. Seen on edge
// it is none: then w is in the range nevertheless, and the slopes are 0.
uvec2 node_of(sight_line line, vec3 normal, vec3 point, float z_min, float z_max)
{
    float along = dot(normal, point), w, steepness;
    if (is_orthographic()) {
        w = w_of((along - dot(normal, line.begin)) / normal.z);
        steepness = 1.0 / (normal.z * (quadtree.depths.y - quadtree.depths.x));
    } else {
        steepness = quadtree.depths.x / along;
        w = steepness * dot(normal, line.step);
    }
    vec2 slopes = normal.xy / quadtree.scale_centre.xy * steepness;
    float w_min = w_of(z_max), w_max = w_of(z_min), slack = PLANE_SHARE * w_max;
    bool is_plane = w > w_min - slack && w < w_max + slack && abs(slopes.x) + abs(slopes.y) < 1e30;
    w = w > w_min ? w : w_min; // in this order: not a number is none
    w = w < w_max ? w : w_max;
    return plane_node(max(w, 0.0), is_plane ? slopes : vec2(0.0), false);
}

uvec2 triangle_node(sight_line line, uint instance_index, uint triangle)
{
    uvec3 corners = texelFetch(triangles, int(triangle)).xyz;
    int texel = int(instance_index) * INSTANCE_TEXELS;
    vec4 rows[3];
    for (int row = 0; row < 3; row++)
        rows[row] = uintBitsToFloat(texelFetch(instances, texel + row));
    vec3 p0 = face_vector(affine_point(rows, texelFetch(positions, int(corners.x)).xyz) - quadtree.eye_world.xyz);
    vec3 p1 = face_vector(affine_point(rows, texelFetch(positions, int(corners.y)).xyz) - quadtree.eye_world.xyz);
    vec3 p2 = face_vector(affine_point(rows, texelFetch(positions, int(corners.z)).xyz) - quadtree.eye_world.xyz);
    return node_of(line, cross(p1 - p0, p2 - p0), p0, min(p0.z, min(p1.z, p2.z)), max(p0.z, max(p1.z, p2.z)));
}

#ifdef HAS_SPHERES
// The nearer intersection, unless it is cut out, or the layer before shows it at this texel or what is behind it.
float sphere_depth(vec2 depths, uvec2 place, uvec2 what, vec3 begin_world, vec3 step_world)
{
    if (is_cut_out(candidate(depths.x, what.y, what.x - 1u, vec2(0.0)), begin_world, step_world, 0.0))
        return depths.y;
    uvec2 before = uvec2(VISIBLE_NOTHING);
    float z_before = quadtree.depths.w;
    if (layer > 0u) {
        before = texelFetch(visible, ivec3(place, slice - 1u), 0).xy;
        z_before = z_of(plane_w(texelFetch(nodes, int(node_index(slice - 1u, 0u, place))).xy));
    }
    float rounding = BEHIND_SHARE * (is_orthographic() ? quadtree.depths.y : z_before);
    return before == what || depths.x < z_before - rounding ? depths.y : depths.x;
}

// Tangent at the point that is seen. Where rounding lets the line miss, that is where the line comes closest.
uvec2 sphere_node(sight_line line, uvec2 place, uvec2 what)
{
    instance i = instance_at(what.x - 1u);
    vec4 sphere = texelFetch(spheres, int(what.y));
    uint row = 3u * (slice / quadtree.layers);
    vec3 begin = quadtree.face_from_world[row].xyz * line.begin.x + quadtree.face_from_world[row + 1u].xyz * line.begin.y;
    vec3 step = quadtree.face_from_world[row].xyz * line.step.x + quadtree.face_from_world[row + 1u].xyz * line.step.y +
                quadtree.face_from_world[row + 2u].xyz;
    begin += quadtree.eye_world.xyz;
    vec3 origin = affine_point(i.object_from_world, begin);
    vec3 direction = affine_vector(i.object_from_world, step);
    vec2 depths;
    bool is_hit = intersect_sphere(origin, direction, sphere.xyz, sphere.w, depths);
    float z = is_hit ? sphere_depth(depths, place, what, begin, step)
                     : dot(sphere.xyz - origin, direction) / dot(direction, direction);
    vec3 normal = is_hit ? face_vector(affine_covector(i.object_from_world, origin + z * direction - sphere.xyz))
                         : vec3(0.0, 0.0, 1.0);
    return node_of(line, normal, line.begin + z * line.step, z, z);
}
#endif

#ifdef HAS_DISCS
uvec2 disc_node(sight_line line, uint index)
{
    disc d = disc_at(index);
    vec3 centre = face_vector(d.centre_radius.xyz - quadtree.eye_world.xyz);
    return node_of(line, face_vector(d.normal.xyz), centre, centre.z - d.centre_radius.w, centre.z + d.centre_radius.w);
}
#endif

void main()
{
    uint item = first_item + item_index();
    uvec2 place = uvec2(item % quadtree.padded_width, item / quadtree.padded_width);
    if (place.y >= quadtree.padded_height)
        return;
    uvec2 node = plane_node(0.0, vec2(0.0), false);
    if (all(lessThan(place, uvec2(quadtree.width, quadtree.height)))) {
        uvec2 what = texelFetch(visible, ivec3(place, slice), 0).xy;
        sight_line line = sight_line_of(place);
        if (what.x == VISIBLE_DISC) {
#ifdef HAS_DISCS
            node = disc_node(line, what.y);
#endif
        } else if (what.x != VISIBLE_NOTHING) {
#ifdef HAS_SPHERES
            if (geometry_at(instance_at(what.x - 1u).geometry).kind == GEOMETRY_SPHERES)
                node = sphere_node(line, place, what);
            else
#endif
                node = triangle_node(line, what.x - 1u, what.y);
        }
    }
    imageStore(planes, int(item), uvec4(node, 0u, 0u));
}
