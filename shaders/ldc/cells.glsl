// SPDX-License-Identifier: MIT
// The walk through a cube's cells, all three images at once: from the first cell on the ray's way that a sample's plane
// passes to the next, so that what is found first is, up to a cell, the nearest. How cells are found is in shared/ldc.h
// (LDC_NODE_*): a node of 16 x 16 x 16 cells knows how far it is empty around it, which of its 64 blocks of 4 x 4 x 4
// hold something, and a block knows that of each cell.
//
// Defines: LDC_LAYERS_TOGETHER 1 or 4 of a texel's samples are tested at once.
#include "ldc/found.glsl"

#ifdef LDC_CELLS

layout(binding = UNIT_TRACER_4) uniform usamplerBuffer ldc_nodes; // and, two texels each, blocks

uniform int ldc_grid[LDC_CUBES]; // nodes along a side

// Axes along which the ray runs down are turned round, so that to the walk it runs up all of them.
struct cell_walk {
    vec3 o, d, inverse;
    ivec3 flip;  // -1: turned
    ivec3 cell;
    float s, s_end;
    float s_least, s_limit; // between which a crossing counts
    float scale;            // s of a distance
    int cube, grid, first_node, octant_shift;
};

// A cell to be tested.
struct found_cell {
    ivec3 cell; // as the walk has it
    int block;  // texel of its block; 0: none
    uint bit;   // of 64
};

// Not turned.
ivec3 cube_cell(cell_walk w, ivec3 cell)
{
    return (cell ^ w.flip) + (w.flip & (w.grid << LDC_NODE_SHIFT));
}

void begin_cells(trace_ray r, float end, int pass, out cell_walk w)
{
    w.cube = pass;
    cube_ray c = cube_ray_of(r, w.cube);
    w.grid = ldc_grid[w.cube];
    w.first_node = ldc_first_node[w.cube];
    bvec3 down = lessThan(c.d, vec3(0.0));
    w.flip = -ivec3(down);
    w.octant_shift = 4 * (int(down.x) + 2 * int(down.y) + 4 * int(down.z));
    w.o = mix(c.o, float(w.grid << LDC_NODE_SHIFT) - c.o, down);
    w.d = abs(c.d);
    w.inverse = 1.0 / w.d;
    w.scale = c.scale;
    w.s_least = r.t_min * c.scale;
    w.s = w.s_least;
    w.s_limit = min(end * c.scale, 1e30);
    w.s_end = w.s_limit;
    int resolution = ldc_resolution[w.cube];
    vec3 lower = mix(vec3(0.0), vec3((w.grid << LDC_NODE_SHIFT) - resolution), down);
    vec3 upper = lower + float(resolution);
    clip(w.s, w.s_end, w.o, w.inverse, lower, upper);
    w.s_end = c.scale > 0.0 && resolution > 0 ? w.s_end : -1e30;
    w.cell = clamp(ivec3(w.o + w.s * w.d), ivec3(lower), ivec3(upper) - 1);
}

// On to the next cell that a plane passes; its block is 0 if there is none.
found_cell next_cell(inout cell_walk w)
{
    found_cell found = found_cell(ivec3(0), 0, 0u);
    while (w.s < w.s_end && found.block == 0) {
        ivec3 c = cube_cell(w, w.cell);
        ivec3 n = c >> LDC_NODE_SHIFT;
        uvec4 node = texelFetch(ldc_nodes, w.first_node + (n.z * w.grid + n.y) * w.grid + n.x);
        uvec3 b = uvec3(c);
        uint block_bit = (b.x >> 2 & 3u) | (b.y & 12u) | (b.z & 4u) << 2; // of 32
        bool upper_half = (b.z & 8u) != 0u;
        uint word = upper_half ? node.y : node.x;
        ivec3 border;
        if ((word >> block_bit & 1u) == 0u) {
            int empty = int(node.z >> w.octant_shift & LDC_NODE_FAR);
            // Eight cells where the other seven blocks are empty too.
            int last = (word & LDC_NODE_EIGHT << (block_bit & 10u)) == 0u ? 7 : 3;
            ivec3 away = ((w.cell >> LDC_NODE_SHIFT) + (empty > 0 ? empty : 1)) << LDC_NODE_SHIFT;
            border = (node.x | node.y) == 0u ? away : (w.cell | last) + 1;
        } else {
            uint rank = uint(bitCount(word & ((1u << block_bit) - 1u))) + (upper_half ? uint(bitCount(node.x)) : 0u);
            int block = int(node.z + 2u * rank);
            uvec4 words = texelFetch(ldc_nodes, block);
            uint cell_bit = (b.x & 3u) | (b.y & 3u) << 2 | (b.z & 1u) << 4;
            uint cells = (b.z & 2u) != 0u ? words.y : words.x;
            found.cell = w.cell;
            found.bit = cell_bit | (b.z & 2u) << 4;
            found.block = (cells >> cell_bit & 1u) != 0u ? block : 0;
            int last = (cells & LDC_NODE_EIGHT << (cell_bit & 10u)) == 0u ? 1 : 0;
            border = (w.cell | last) + 1;
        }
        vec3 exits = (vec3(border) - w.o) * w.inverse;
        float s_out = exits.x < exits.y ? exits.x : exits.y;
        s_out = exits.z < s_out ? exits.z : s_out;
        ivec3 next = clamp(ivec3(w.o + s_out * w.d), w.cell, border - 1);
        // In whole numbers, so that each step goes on.
        w.cell = mix(next, border, equal(exits, vec3(s_out)));
        w.s = w.s < s_out ? s_out : w.s;
    }
    return found;
}

void test_cell_sample(inout cell_walk w, int axis, ivec3 cell, uint sample_index, float depth, uint normal_bits,
                      inout ldc_found found)
{
    vec3 flipped = vec3(w.flip);
    vec3 normal = direction_from_octahedral(normal_bits) * (1.0 + 2.0 * flipped);
    float flip_depth = in_image(flipped, axis).z;
    float turned = flip_depth < 0.0 ? float(w.grid << LDC_NODE_SHIFT) - depth : depth;
    float s, side;
    if (cross_sample(in_image(w.o, axis), in_image(w.d, axis), w.cube, in_image(vec3(cell), axis).xy, turned,
                     in_image(normal, axis), s, side) &&
        s > w.s_least && s < w.s_limit) {
        offer_sample(found, sample_index, s / w.scale, side, 1.0 / w.scale);
        w.s_limit = found.end * w.scale;
    }
}

void test_cell(inout cell_walk w, found_cell at, inout ldc_found found)
{
    uvec4 first = texelFetch(ldc_nodes, at.block), second = texelFetch(ldc_nodes, at.block + 1);
    bool upper_half = at.bit >= 32u;
    uint bit = at.bit & 31u;
    uint axes = ((upper_half ? first.w : first.z) >> bit & 1u) | ((upper_half ? second.y : second.x) >> bit & 1u) << 1 |
                ((upper_half ? second.w : second.z) >> bit & 1u) << 2;
    ivec3 c = cube_cell(w, at.cell);
    int resolution = ldc_resolution[w.cube];
    while (axes != 0u) {
        int axis = findLSB(axes);
        axes &= axes - 1u;
        ivec3 place = axis == 0 ? c.yzx : axis == 1 ? c.zxy : c;
        uvec4 words = texelFetch(ldc_texels, ldc_first_texel[w.cube] + (axis * resolution + place.y) * resolution + place.x);
        uint count = words.y & LDC_TEXEL_COUNT_MASK;
        float low = float(place.z) - LDC_SPAN, high = float(place.z) + 1.0 + LDC_SPAN;
#if LDC_LAYERS_TOGETHER == 4
        uint first_quad = words.y >> LDC_TEXEL_QUAD_SHIFT;
        float middle = 0.5 * (low + high), reach = 0.5 * (high - low);
        for (uint i = 0u; i < count; i += 4u) {
            vec4 depths = texelFetch(ldc_quads, int(first_quad + i / 4u));
            bvec4 meet = lessThanEqual(abs(depths - middle), vec4(reach));
            uint left = (meet.x ? 1u : 0u) | (meet.y ? 2u : 0u) | (meet.z ? 4u : 0u) | (meet.w ? 8u : 0u);
            while (left != 0u) {
                uint k = uint(findLSB(left));
                left &= left - 1u;
                float depth = k < 2u ? (k == 0u ? depths.x : depths.y) : (k == 2u ? depths.z : depths.w);
                uint sample_index = words.x + i + k;
                test_cell_sample(w, axis, at.cell, sample_index, depth,
                                 texelFetch(ldc_geometry, int(sample_index)).y, found);
            }
            if (depths.w > high)
                break;
        }
#else
        for (uint i = 0u; i < count; i++) {
            uvec4 g = texelFetch(ldc_geometry, int(words.x + i));
            float depth = uintBitsToFloat(g.x);
            if (depth > high)
                break;
            if (depth >= low)
                test_cell_sample(w, axis, at.cell, words.x + i, depth, g.y, found);
        }
#endif
    }
    w.s_end = w.s_end < w.s_limit ? w.s_end : w.s_limit;
}

#endif
