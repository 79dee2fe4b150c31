// SPDX-License-Identifier: MIT
// Writes boxes (refit_bounds.comp) as elements for the traversal, in all octants' copies. Its twin in C is
// bvh_write_element() in trace/tree/build_element.c.
//
// Defines: BVH_PACKED, BVH_SPHERES as in traverse.glsl, one of them or none; BVH_ONE_ORDER there is only octant 0's copy.
#include "tree/layout.h"
#include "common/dispatch.glsl"
#include "shared/bindings.h"

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer records; // bvh_refit_record
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer boxes;
layout(std430, binding = BIND_TRACER_0) writeonly buffer element_block { uvec4 elements[]; };
uniform uint record_count;
uniform uint first_box;
uniform uint first_texel; // first texel of the tree's elements
uniform vec3 grid_lower, cells_per_unit;

#ifdef BVH_ONE_ORDER
const uint COPIES = 1u;
#else
const uint COPIES = BVH_OCTANTS;
#endif
const float PAD_RELATIVE = 4.76837158203125e-7; // 2^-21, the builder's BVH_PAD_RELATIVE
const float PAD_MIN = 1.17549435e-38;
// The builder's GRID_PAD, which is computed in doubles, and the rounding error of floats on coordinates of up to 65535
// cells: 4 units in the last place.
const float GRID_PAD = 0.0625;
const float CELLS = float(BVH_GRID_CELLS);

// The negated comparisons make the box larger for NaN.
uint cell_below(float x)
{
    return x > 0.0 ? uint(min(x, CELLS)) : 0u;
}
uint cell_above(float x)
{
    return x < CELLS ? uint(ceil(max(x, 0.0))) : BVH_GRID_CELLS;
}

void main()
{
    uint i = item_index();
    if (i >= record_count)
        return;
    int at = int(i) * BVH_REFIT_TEXELS;
    uvec4 record = texelFetch(records, at), places_0123 = texelFetch(records, at + 1), places_4567 = texelFetch(records, at + 2);
    int box_texel = int((first_box + record.x) * BVH_REFIT_BOX_TEXELS);
    vec3 lower = uintBitsToFloat(texelFetch(boxes, box_texel).xyz);
    vec3 upper = uintBitsToFloat(texelFetch(boxes, box_texel + 1).xyz);
#ifdef BVH_SPHERES
    vec3 centre = 0.5 * lower + 0.5 * upper;
    float radius = length(upper - centre);
    float magnitude = abs(centre.x) + abs(centre.y) + abs(centre.z) + radius;
    uvec3 first_half = floatBitsToUint(centre);
    uvec4 second_half = uvec4(floatBitsToUint(radius + 2.0 * magnitude * PAD_RELATIVE + PAD_MIN), 0u, 0u, 0u);
#else
    lower -= abs(lower) * PAD_RELATIVE + PAD_MIN;
    upper += abs(upper) * PAD_RELATIVE + PAD_MIN;
#ifdef BVH_PACKED
    vec3 low = (lower - grid_lower) * cells_per_unit - GRID_PAD, high = (upper - grid_lower) * cells_per_unit + GRID_PAD;
    uvec3 near = uvec3(cell_below(low.x), cell_below(low.y), cell_below(low.z));
    uvec3 far = uvec3(cell_above(high.x), cell_above(high.y), cell_above(high.z));
    uvec3 forward = near | far << 16, backward = far | near << 16;
#else
    uvec3 first_half = floatBitsToUint(lower);
    uvec4 second_half = uvec4(floatBitsToUint(upper), 0u);
#endif
#endif
    for (uint octant = 0u; octant < COPIES; octant++) {
        uint place = octant < 4u ? places_0123[octant] : places_4567[octant & 3u];
        uint link = record.z != 0u ? record.z : place + record.y;
        uint element = octant * record_count + place;
#if defined BVH_PACKED && !defined BVH_SPHERES
        bvec3 negative = notEqual(uvec3(octant) & uvec3(1u, 2u, 4u), uvec3(0u));
        elements[first_texel + element] = uvec4(mix(forward, backward, negative), link);
#else
        elements[first_texel + 2u * element] = uvec4(first_half, link);
        elements[first_texel + 2u * element + 1u] = second_half;
#endif
    }
}
