// SPDX-License-Identifier: MIT
// Refits the boxes of a tree whose triangles have moved, bottom-up: one dispatch for the leaves, which also writes their
// triangles where the traversal reads them, then one for each level above them (trace/tree/build_refit.c). The order and
// links of the tree stay.
//
// The output is a storage buffer: measured on software GL, it takes 0.7 of the time of an image.
//
// Defines: REFIT_LEAVES for the leaves' pass, REFIT_CLOSE where their triangles move while the shutter is open.
#include "tree/layout.h"
#include "common/dispatch.glsl"
#include "shared/bindings.h"

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer records; // bvh_refit_record
layout(std430, binding = BIND_TRACER_1) buffer box_block { uvec4 boxes[]; };
uniform uint first_record;
uniform uint record_count;
uniform uint first_box; // texel of this tree's first box

const float FAR = 3.402823466e38;

struct box {
    vec3 lower, upper;
    vec2 surfaces; // sum over all boxes below it; over each triangle's own
};

box empty_box()
{
    return box(vec3(FAR), vec3(-FAR), vec2(0.0));
}

float surface_of(box b)
{
    vec3 extent = b.upper - b.lower;
    return extent.x >= 0.0 ? extent.x * extent.y + extent.y * extent.z + extent.z * extent.x : 0.0;
}

// Includes the corners in the box, except NaN.
void include(inout box b, vec3 lower, vec3 upper)
{
    b.lower = mix(b.lower, lower, lessThan(lower, b.lower));
    b.upper = mix(b.upper, upper, greaterThan(upper, b.upper));
}

void store(uvec4 record, box b)
{
    b.surfaces.x += surface_of(b);
    uint texel = first_box + record.x * BVH_REFIT_BOX_TEXELS;
    boxes[texel] = uvec4(floatBitsToUint(b.lower), record.y);
    boxes[texel + 1u] = uvec4(floatBitsToUint(b.upper), 0u);
    boxes[texel + 2u].xy = floatBitsToUint(b.surfaces);
}

#ifdef REFIT_LEAVES

layout(binding = UNIT_TRACER_1) uniform usamplerBuffer corners; // vertices of the mesh and number of each triangle
layout(binding = UNIT_POSITIONS) uniform samplerBuffer positions;
layout(std430, binding = BIND_TRACER_0) writeonly buffer primitive_block { uvec4 primitives[]; }; // tree/layout.h
uniform uint first_texel;  // first texel of this tree's primitives
uniform uint close_texels; // offset from a triangle to itself at shutter close
uniform uint first_vertex; // first vertex of the mesh in `positions`
uniform uint close_offset; // offset of vertices at shutter close, as in struct geometry

void move(uint texel, ivec3 vertices, uint number, inout box b)
{
    vec3 v0 = texelFetch(positions, vertices.x).xyz, v1 = texelFetch(positions, vertices.y).xyz,
         v2 = texelFetch(positions, vertices.z).xyz;
    primitives[texel] = uvec4(floatBitsToUint(v0), number);
    primitives[texel + 1u] = uvec4(floatBitsToUint(v1), 0u);
    primitives[texel + 2u] = uvec4(floatBitsToUint(v2), 0u);
    include(b, v0, v0);
    include(b, v1, v1);
    include(b, v2, v2);
}

void refit(uvec4 record)
{
    box b = empty_box();
    uint first = record.z & BVH_LEAF_FIRST_MASK, count = (record.z >> BVH_LEAF_COUNT_SHIFT & BVH_LEAF_COUNT_MASK) + 1u;
    for (uint i = first; i < first + count; i++) {
        uint texel = first_texel + i * BVH_TRIANGLE_TEXELS;
        uvec4 triangle = texelFetch(corners, int(i));
        box own = empty_box();
        move(texel, ivec3(triangle.xyz + first_vertex), triangle.w, own);
#ifdef REFIT_CLOSE
        move(texel + close_texels, ivec3(triangle.xyz + first_vertex + close_offset), triangle.w, own);
#endif
        b.surfaces.y += surface_of(own);
        include(b, own.lower, own.upper);
    }
    store(record, b);
}

#else

void refit(uvec4 record)
{
    box b = empty_box();
    for (uint child = record.x + 1u, end = record.x + record.y; child < end;) {
        uint texel = first_box + child * BVH_REFIT_BOX_TEXELS;
        uvec4 lower = boxes[texel], upper = boxes[texel + 1u];
        include(b, uintBitsToFloat(lower.xyz), uintBitsToFloat(upper.xyz));
        b.surfaces += uintBitsToFloat(boxes[texel + 2u].xy);
        child += lower.w;
    }
    store(record, b);
}

#endif

void main()
{
    uint i = item_index();
    if (i < record_count)
        refit(texelFetch(records, int(first_record + i) * BVH_REFIT_TEXELS));
}
