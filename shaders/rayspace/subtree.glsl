// SPDX-License-Identifier: MIT
// Traversal of a part of an instance's tree by a single ray: an element, and the elements below it in the tree's
// depth-first order, by links. No bundle is narrower than a ray: a pass for each level would gain nothing, and would not
// know which hits are near.
//
// Defines: RAYSPACE_PACKED boxes are on a grid, else in floats.
#include "common/candidate.glsl"
#include "common/math.glsl"
#include "tree/layout.h"
#include "tree/slack.glsl"

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer tree_elements;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer tree_transforms;

// Part of a tree. Planes of boxes at p are hit at p scale - offset.
struct subtree {
    uint first_element;                 // first element of the tree
    uint first_texel, first_primitive;  // first primitive of the instance: in the order of the tree; in the scene
    uint element, end;                  // next element, and the end
    vec3 scale, near_offset, far_offset;
    bvec3 negative; // signs of the ray's direction
};

uvec4 fetch_element(subtree part)
{
#ifdef RAYSPACE_PACKED
    return texelFetch(tree_elements, int(part.first_element + part.element));
#else
    return texelFetch(tree_elements, 2 * int(part.first_element + part.element));
#endif
}

subtree subtree_of(uint instance_index, uint element, object_ray o)
{
    int texel = int(instance_index) * BVH_TRANSFORM_TEXELS;
    uvec4 place = texelFetch(tree_transforms, texel + 5);
    vec3 grid_lower = vec3(0.0), cells_per_unit = vec3(1.0);
#ifdef RAYSPACE_PACKED
    grid_lower = uintBitsToFloat(texelFetch(tree_transforms, texel + 3).xyz);
    cells_per_unit = uintBitsToFloat(texelFetch(tree_transforms, texel + 4).xyz);
#endif
    // A zero component would give infinity times zero. Its replacement moves the ray sideways by 1e-12 of its length, far
    // below the slack.
    vec3 d = o.direction * cells_per_unit;
    float smallest = 1e-12 * max_component(abs(d));
    vec3 origin = (o.origin - grid_lower) * cells_per_unit;
    subtree part;
    part.first_element = place.x;
    part.first_texel = place.z;
    part.first_primitive = place.w;
    part.scale = 1.0 / mix(d, vec3(smallest), lessThan(abs(d), vec3(smallest)));
    vec3 slack = OBJECT_SLACK * (abs(o.origin) + abs(grid_lower)) * cells_per_unit * abs(part.scale);
    part.near_offset = origin * part.scale + slack;
    part.far_offset = origin * part.scale - slack;
    part.negative = lessThan(part.scale, vec3(0.0));
    part.element = element;
    uint link = fetch_element(part).w;
    part.end = link >> BVH_LEAF_KIND_SHIFT != 0u ? element + 1u : max(link, element + 1u);
    return part;
}

// Tests an element, and advances to the next one. Returns its link if it is a leaf that the ray may hit, else 0.
uint test_element(inout subtree part, float t_min, float t_max)
{
    uvec4 texel = fetch_element(part);
    uint link = texel.w;
#ifdef RAYSPACE_PACKED
    uvec3 nearer = mix(uvec3(0u), uvec3(16u), part.negative);
    vec3 near = vec3(ivec3(texel.xyz >> nearer & 0xffffu)), far = vec3(ivec3(texel.xyz >> (16u - nearer) & 0xffffu));
#else
    vec3 lower = uintBitsToFloat(texel.xyz);
    vec3 upper = uintBitsToFloat(texelFetch(tree_elements, 2 * int(part.first_element + part.element) + 1).xyz);
    vec3 near = mix(lower, upper, part.negative), far = mix(upper, lower, part.negative);
#endif
    vec3 enter = near * part.scale - part.near_offset, leave = far * part.scale - part.far_offset;
    // NaN is ignored or, in the last comparison, counts as a hit: hence the negation.
    float first = max(max(enter.x, enter.y), max(enter.z, t_min));
    float last = min(min(leave.x, leave.y), min(leave.z, t_max));
    bool is_hit = !(first > last), is_leaf = link >> BVH_LEAF_KIND_SHIFT != 0u;
    part.element = is_hit || is_leaf ? part.element + 1u : max(link, part.element + 1u);
    return is_hit && is_leaf ? link : 0u;
}
