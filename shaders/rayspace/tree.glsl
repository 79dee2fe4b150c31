// SPDX-License-Identifier: MIT
// Elements of the trees over the scene (tree/layout.h), with bounds in world space. There is one order of elements.
//
// Defines: RAYSPACE_PACKED boxes are on a grid, else in floats.
#include "rayspace/meet.glsl"
#include "common/motion.glsl"
#include "tree/layout.h"

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer tree_elements;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer tree_transforms;

uniform uint top_count; // elements of the top tree
#ifdef RAYSPACE_PACKED
uniform vec3 top_grid_lower, top_cell; // lower corner and size of a cell of the top tree's grid
#endif

// Tree of a pair: its place, and the transform of its boxes to world space.
struct tree_place {
    uint first, count;
    vec3 grid_lower, cell;
    vec4 world_from_object[3];
    bool is_top;
    uint motion, pose_count; // those of the instance
};

struct tree_element {
    uint link;
    vec3 lower, upper; // in the tree's space
};

tree_place tree_of(uint instance_index)
{
    tree_place tree;
    tree.is_top = instance_index == RAYSPACE_TOP;
    tree.first = 0u;
    tree.count = top_count;
    tree.grid_lower = vec3(0.0);
    tree.cell = vec3(1.0);
    tree.world_from_object =
        vec4[3](vec4(1.0, 0.0, 0.0, 0.0), vec4(0.0, 1.0, 0.0, 0.0), vec4(0.0, 0.0, 1.0, 0.0));
    tree.motion = tree.pose_count = 0u;
#ifdef RAYSPACE_PACKED
    tree.grid_lower = top_grid_lower;
    tree.cell = top_cell;
#endif
    if (tree.is_top)
        return tree;
    int texel = int(instance_index) * BVH_TRANSFORM_TEXELS;
    instance i = instance_at(instance_index);
    uvec4 place = texelFetch(tree_transforms, texel + 5);
    tree.first = place.x;
    tree.count = place.y;
    tree.world_from_object = i.world_from_object;
    tree.motion = i.motion;
    tree.pose_count = i.flags >> INSTANCE_POSES_SHIFT & INSTANCE_POSES_MASK;
#ifdef RAYSPACE_PACKED
    tree.grid_lower = uintBitsToFloat(texelFetch(tree_transforms, texel + 3)).xyz;
    tree.cell = 1.0 / uintBitsToFloat(texelFetch(tree_transforms, texel + 4)).xyz;
#endif
    return tree;
}

tree_element element_at(tree_place tree, uint element)
{
#ifdef RAYSPACE_PACKED
    uvec4 texel = texelFetch(tree_elements, int(tree.first + element));
    vec3 lower = tree.grid_lower + vec3(ivec3(texel.xyz & 0xffffu)) * tree.cell;
    vec3 upper = tree.grid_lower + vec3(ivec3(texel.xyz >> 16)) * tree.cell;
    // Rounding of the arithmetic above; the boxes include that of the cells.
    vec3 slack = 4.768e-7 * (abs(tree.grid_lower) + max(abs(lower), abs(upper)));
    return tree_element(texel.w, lower - slack, upper + slack);
#else
    uvec4 first = texelFetch(tree_elements, 2 * int(tree.first + element));
    uvec4 second = texelFetch(tree_elements, 2 * int(tree.first + element) + 1);
    return tree_element(first.w, uintBitsToFloat(first.xyz), uintBitsToFloat(second.xyz));
#endif
}

// Box of an object-space box in world space, rounded outward.
void box_in_world(vec4 rows[3], vec3 centre, vec3 half_size, inout vec3 lower, inout vec3 upper)
{
    for (int row = 0; row < 3; row++) {
        vec3 m = rows[row].xyz;
        float middle = dot(m, centre) + rows[row].w, half_ = dot(abs(m), half_size);
        half_ += 1.9073e-6 * (dot(abs(m), abs(centre)) + abs(rows[row].w) + half_); // 2^-19
        lower[row] = min(lower[row], middle - half_);
        upper[row] = max(upper[row], middle + half_);
    }
}

bounds bounds_of_box(vec3 lower, vec3 upper)
{
    vec3 half_size = 0.5 * upper - 0.5 * lower;
    return bounds(lower + half_size, length(half_size) * 1.000004, lower, upper);
}

// Bounds of the element over the whole time that the shutter is open.
bounds bounds_of(tree_place tree, tree_element e)
{
    if (tree.is_top)
        return bounds_of_box(e.lower, e.upper);
    vec3 half_size = 0.5 * e.upper - 0.5 * e.lower, centre = e.lower + half_size;
    vec3 lower = vec3(3e38), upper = vec3(-3e38);
    box_in_world(tree.world_from_object, centre, half_size, lower, upper);
#ifdef HAS_MOTION
    if (tree.motion != 0u) {
        for (uint pose = 1u; pose < tree.pose_count; pose++) {
            int texel = int(tree.motion - 1u + 3u * pose);
            vec4 rows[3] = vec4[3](texelFetch(motions, texel), texelFetch(motions, texel + 1),
                                   texelFetch(motions, texel + 2));
            box_in_world(rows, centre, half_size, lower, upper);
        }
    }
#endif
    return bounds_of_box(lower, upper);
}

bool is_leaf(uint link)
{
    return link >> BVH_LEAF_KIND_SHIFT != 0u;
}

bool is_instance(uint link)
{
    return link >> BVH_LEAF_KIND_SHIFT == BVH_LEAF_INSTANCE;
}

// Root link of an instance's tree. False: the tree is empty.
bool root_link_of(uint instance_index, out uint link)
{
    uvec4 place = texelFetch(tree_transforms, int(instance_index) * BVH_TRANSFORM_TEXELS + 5);
#ifdef RAYSPACE_PACKED
    link = texelFetch(tree_elements, int(place.x)).w;
#else
    link = texelFetch(tree_elements, 2 * int(place.x)).w;
#endif
    return place.y > 0u;
}
