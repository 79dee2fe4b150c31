// SPDX-License-Identifier: MIT
// Makes the leaves of one slice: for each texel the plane of the visible primitive, in (x, y, w), from the primitive
// itself and not from differences of depths (section 3.2 of the paper, "g-buffer normals"). nodes.comp writes them to the
// tree, with their flags. An invocation makes four leaves: most often they show the same primitive, which is fetched
// once.
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

uniform uint first_item; // first item of the dispatch
uniform uint first_leaf; // in `planes`
uniform uint slice;
uniform uint layer; // layer of the face; its slice follows that of the layer before

// Rounding of a node's depth, as a share of it.
const float BEHIND_SHARE = 3.8147e-6; // 2^-18
// Share of w by which a sliver's plane may leave the sliver's depths; beyond it the plane is too uncertain to be used.
const float PLANE_SHARE = 0.001953125; // 2^-9

// Vector along the axes of the face, from the eye.
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

// X / Z in the middle of a texel, or X in an orthographic view; Y by analogy.
vec2 across_of(uvec2 place)
{
    return (vec2(place) + 0.5 - quadtree.scale_centre.zw) / quadtree.scale_centre.xy;
}

// Line of sight through the middle of a texel: the points `begin` + Z * `step` of the face.
struct sight_line {
    vec3 begin, step;
};

sight_line sight_line_of(uvec2 place)
{
    vec2 across = across_of(place);
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

// Plane of a primitive, along the axes of the face from the eye, and the range of its depths.
struct plane {
    vec3 normal, point;
    float z_min, z_max;
};

// Nodes of the texel at `place`, of that to the right, and of those below, if they show this plane. A plane seen on edge
// has none: w is clamped to the range nevertheless, and the slopes are 0.
void nodes_of(plane p, uvec2 place, out uvec4 heads, out uvec4 tails)
{
    vec2 first = across_of(place), last = across_of(place + 1u);
    vec4 rise = p.normal.x * vec4(first.x, last.x, first.x, last.x) + p.normal.y * vec4(first.y, first.y, last.y, last.y);
    float along = dot(p.normal, p.point), steepness;
    vec4 w;
    if (is_orthographic()) {
        float depth = quadtree.depths.y - quadtree.depths.x;
        w = (quadtree.depths.y - (along - rise) / p.normal.z) / depth;
        steepness = 1.0 / (p.normal.z * depth);
    } else {
        steepness = quadtree.depths.x / along;
        w = steepness * (rise + p.normal.z);
    }
    vec2 slopes = p.normal.xy / quadtree.scale_centre.xy * steepness;
    float w_min = w_of(p.z_max), w_max = w_of(p.z_min), slack = PLANE_SHARE * w_max;
    uint tail = plane_tail(abs(slopes.x) + abs(slopes.y) < 1e30 ? slopes : vec2(0.0));
    tails = mix(uvec4(0u), uvec4(tail), greaterThan(w, vec4(w_min - slack)));
    tails = mix(uvec4(0u), tails, lessThan(w, vec4(w_max + slack)));
    w = mix(vec4(w_min), w, greaterThan(w, vec4(w_min))); // in this order NaN becomes w_min
    w = mix(vec4(w_max), w, lessThan(w, vec4(w_max)));
    heads = plane_heads(max(w, 0.0));
}

plane triangle_plane(uint instance_index, uint triangle)
{
    uvec3 corners = texelFetch(triangles, int(triangle)).xyz;
    int texel = int(instance_index) * INSTANCE_TEXELS;
    vec4 rows[3];
    for (int row = 0; row < 3; row++)
        rows[row] = uintBitsToFloat(texelFetch(instances, texel + row));
    vec3 p0 = face_vector(affine_point(rows, texelFetch(positions, int(corners.x)).xyz) - quadtree.eye_world.xyz);
    vec3 p1 = face_vector(affine_point(rows, texelFetch(positions, int(corners.y)).xyz) - quadtree.eye_world.xyz);
    vec3 p2 = face_vector(affine_point(rows, texelFetch(positions, int(corners.z)).xyz) - quadtree.eye_world.xyz);
    return plane(cross(p1 - p0, p2 - p0), p0, min(p0.z, min(p1.z, p2.z)), max(p0.z, max(p1.z, p2.z)));
}

#ifdef HAS_SPHERES
// Depth of the nearer intersection, unless it is cut out, or the layer before shows it, or one behind it, at this texel.
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

// Tangent plane at the visible point. Where rounding makes the line miss, that is its closest point.
plane sphere_plane(uvec2 place, uvec2 what)
{
    sight_line line = sight_line_of(place);
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
    return plane(normal, line.begin + z * line.step, z, z);
}
#endif

#ifdef HAS_DISCS
plane disc_plane(uint index)
{
    disc d = disc_at(index);
    vec3 centre = face_vector(d.centre_radius.xyz - quadtree.eye_world.xyz);
    return plane(face_vector(d.normal.xyz), centre, centre.z - d.centre_radius.w, centre.z + d.centre_radius.w);
}
#endif

plane flat_plane(uvec2 what)
{
#ifdef HAS_DISCS
    if (what.x == VISIBLE_DISC)
        return disc_plane(what.y);
#endif
    return triangle_plane(what.x - 1u, what.y);
}

uvec2 what_at(uvec2 place)
{
    bool is_inside = all(lessThan(place, uvec2(quadtree.width, quadtree.height)));
    return is_inside ? texelFetch(visible, ivec3(place, slice), 0).xy : uvec2(VISIBLE_NOTHING);
}

void main()
{
    uint item = first_item + item_index();
    uint columns = quadtree.padded_width / 2u;
    if (item >= columns * (quadtree.padded_height / 2u))
        return;
    uvec2 place = 2u * uvec2(item % columns, item / columns);
    uvec2 a = what_at(place), b = what_at(place + uvec2(1u, 0u)), c = what_at(place + uvec2(0u, 1u)), d = what_at(place + 1u);
    uvec4 instances_left = uvec4(a.x, b.x, c.x, d.x), primitives = uvec4(a.y, b.y, c.y, d.y);
    uvec4 heads = plane_heads(vec4(0.0)), tails = uvec4(0u), own_heads, own_tails;
    // Runs a turn for each primitive, or texel of a sphere.
    while (instances_left != uvec4(VISIBLE_NOTHING)) {
        bvec4 is_left = notEqual(instances_left, uvec4(VISIBLE_NOTHING));
        uint first = is_left.x ? 0u : is_left.y ? 1u : is_left.z ? 2u : 3u;
        uvec2 what = uvec2(instances_left[first], primitives[first]);
        bvec4 is_own = equal((instances_left ^ what.x) | (primitives ^ what.y), uvec4(0u));
        plane p;
#ifdef HAS_SPHERES
        if (what.x != VISIBLE_DISC && geometry_at(instance_at(what.x - 1u).geometry).kind == GEOMETRY_SPHERES) {
            is_own = equal(uvec4(0u, 1u, 2u, 3u), uvec4(first));
            p = sphere_plane(place + uvec2(first & 1u, first >> 1), what);
        } else
#endif
            p = flat_plane(what);
        nodes_of(p, place, own_heads, own_tails);
        heads = mix(heads, own_heads, is_own);
        tails = mix(tails, own_tails, is_own);
        instances_left = mix(instances_left, uvec4(VISIBLE_NOTHING), is_own);
    }
    int at = int(first_leaf + place.y * quadtree.padded_width + place.x), below = at + int(quadtree.padded_width);
    imageStore(planes, at, uvec4(heads.x, tails.x, 0u, 0u));
    imageStore(planes, at + 1, uvec4(heads.y, tails.y, 0u, 0u));
    imageStore(planes, below, uvec4(heads.z, tails.z, 0u, 0u));
    imageStore(planes, below + 1, uvec4(heads.w, tails.w, 0u, 0u));
}
