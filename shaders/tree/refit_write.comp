// SPDX-License-Identifier: MIT
// Writes boxes (refit_bounds.comp) as elements for the traversal, in all octants' copies. Its twin in C is
// bvh_write_element() in trace/tree/build_element.c.
//
// Defines: BVH_PACKED, BVH_SPHERES, BVH_WIDE as in traverse.glsl, one of them or none; BVH_ONE_ORDER there is only octant 0's
// copy.
#include "tree/layout.h"
#include "common/dispatch.glsl"
#include "shared/bindings.h"

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer records; // bvh_refit_record
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer boxes;
#ifdef BVH_WIDE
layout(std430, binding = BIND_TRACER_0) buffer element_block { uvec4 elements[]; };
#else
layout(std430, binding = BIND_TRACER_0) writeonly buffer element_block { uvec4 elements[]; };
#endif
uniform uint first_record;
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

void pad(inout vec3 lower, inout vec3 upper)
{
    lower -= abs(lower) * PAD_RELATIVE + PAD_MIN;
    upper += abs(upper) * PAD_RELATIVE + PAD_MIN;
}

#ifdef BVH_WIDE

// Rounding of a place in cells, some units in the last place of 255: the builder's twin computes in doubles.
const float BYTE_PAD = 0.000244140625;
const float BYTE_MAX = 255.0;

// Exponent of the smallest cell of which 255, less the pad, reach that far.
int exponent_of(float extent)
{
    int exponent = int(floatBitsToUint(extent / (BYTE_MAX - 1.0)) >> 23 & 0xffu) - 127 + 1;
    return clamp(exponent, -126, 127);
}

// Sets a child's lower planes in a byte of each axis' words, and its upper ones. The negated comparisons make the box larger for
// NaN.
void set_planes(inout uvec2 lower_words[3], inout uvec2 upper_words[3], uint slot, vec3 low, vec3 high)
{
    for (int k = 0; k < 3; k++) {
        uint first = low[k] > 0.0 ? uint(min(low[k], BYTE_MAX)) : 0u;
        uint last = high[k] < BYTE_MAX ? uint(ceil(max(high[k], 0.0))) : 255u;
        uvec2 here = slot < 4u ? uvec2(1u, 0u) : uvec2(0u, 1u);
        lower_words[k] |= here * (first << 8u * (slot & 3u));
        upper_words[k] |= here * (last << 8u * (slot & 3u));
    }
}

// Writes the boxes of a node's children; what its slots hold stays.
void main()
{
    uint i = item_index();
    if (i >= record_count)
        return;
    int at = int(first_record + i) * BVH_REFIT_TEXELS;
    uvec4 record = texelFetch(records, at);
    uint texel = first_texel + texelFetch(records, at + 1).x * BVH_WIDE_TEXELS;
    int box_texel = int((first_box + record.x) * BVH_REFIT_BOX_TEXELS);
    vec3 lower = uintBitsToFloat(texelFetch(boxes, box_texel).xyz);
    vec3 upper = uintBitsToFloat(texelFetch(boxes, box_texel + 1).xyz);
    pad(lower, upper);
    ivec3 exponents = ivec3(exponent_of(upper.x - lower.x), exponent_of(upper.y - lower.y), exponent_of(upper.z - lower.z));
    vec3 cells_per_unit_here = uintBitsToFloat(uvec3(127 - exponents) << 23);
    uvec2 meta = elements[texel + 1u].zw;
    uvec2 lower_words[3] = uvec2[3](uvec2(0u), uvec2(0u), uvec2(0u)), upper_words[3] = lower_words;
    uint child = record.x + 1u;
    for (uint slot = 0u; slot < BVH_WIDE_SLOTS; slot++) {
        if (((slot < 4u ? meta.x : meta.y) >> 8u * (slot & 3u) & 0xffu) == 0u)
            continue;
        int child_texel = int((first_box + child) * BVH_REFIT_BOX_TEXELS);
        uvec4 first_half = texelFetch(boxes, child_texel);
        vec3 child_lower = uintBitsToFloat(first_half.xyz);
        vec3 child_upper = uintBitsToFloat(texelFetch(boxes, child_texel + 1).xyz);
        pad(child_lower, child_upper);
        set_planes(lower_words, upper_words, slot, (child_lower - lower) * cells_per_unit_here - BYTE_PAD,
                   (child_upper - lower) * cells_per_unit_here + BYTE_PAD);
        child += first_half.w;
    }
    uint inner = elements[texel].w & 0xff000000u;
    uvec3 bytes = uvec3(exponents) & 0xffu;
    elements[texel] = uvec4(floatBitsToUint(lower), bytes.x | bytes.y << 8 | bytes.z << 16 | inner);
    elements[texel + 2u] = uvec4(lower_words[0], lower_words[1]);
    elements[texel + 3u] = uvec4(lower_words[2], upper_words[0]);
    elements[texel + 4u] = uvec4(upper_words[1], upper_words[2]);
}

#else

void main()
{
    uint i = item_index();
    if (i >= record_count)
        return;
    int at = int(first_record + i) * BVH_REFIT_TEXELS;
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
    pad(lower, upper);
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

#endif
