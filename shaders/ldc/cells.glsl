// SPDX-License-Identifier: MIT
// Traversal of a cube's cells for all three images at once: from one occupied cell along the ray to the next, so that the
// first intersection is, up to a cell, the nearest. Cells are described in ldc/layout.h: a node of 16 x 16 x 16 cells
// knows the empty space round it and which of its 64 blocks of 4 x 4 x 4 are occupied, and a block knows its occupied
// cells.
#include "ldc/found.glsl"
#include "raster/blocks.glsl"

#ifdef LDC_CELLS

layout(binding = UNIT_TRACER_4) uniform usamplerBuffer ldc_nodes; // nodes and blocks

layout(binding = UNIT_TRACER_5) uniform usamplerBuffer ldc_entries;

uniform int ldc_grid[LDC_CUBES]; // nodes along a side
uniform vec3 ldc_lower[LDC_CUBES], ldc_upper[LDC_CUBES]; // bounds of the occupied cells

// Axes are mirrored as in raster/blocks.glsl.
struct cell_traversal {
    vec3 o, d, inverse;
    ivec3 flip;  // -1: turned
    ivec3 cell;
    float s, s_end;
    float s_min, s_limit; // range in which intersections count
    float begin, scale; // those of cell_ray
    int cube, grid, first_node, octant_shift;
#ifdef LDC_EXACT
    float beside_max; // extension of a sample's plane beyond its texel
    bool is_within;   // the last intersection is at most LDC_SLACK beyond its texel
#endif
    int at, shift; // texel of the current node or block; log2 of the size of its parts: 2 in a node, 0 in a block
};

#ifdef LDC_EXACT
#define BESIDE_MAX w.beside_max
#else
#define BESIDE_MAX LDC_SLACK
#endif

// A cell to be tested.
struct found_cell {
    ivec3 cell; // mirrored
    uint entry; // LDC_ENTRY_NONE: there is none
};

// Cell of the cube, with mirrored axes turned back.
ivec3 cube_cell(cell_traversal w, ivec3 cell)
{
    return turned(cell, w.flip, w.grid << LDC_NODE_SHIFT);
}

// Texel of the node or block that the ray is in, whose lower corner is `cell`.
int node_at(cell_traversal w, ivec3 cell)
{
    ivec3 n = cube_cell(w, cell) >> LDC_NODE_SHIFT;
    return w.first_node + (n.z * w.grid + n.y) * w.grid + n.x;
}

void begin_cells(trace_ray r, float end, int pass, out cell_traversal w)
{
    w.cube = pass;
    cell_ray c = cube_ray_of(r, w.cube);
    w.grid = ldc_grid[CUBE(w.cube)];
    w.first_node = ldc_first_node[CUBE(w.cube)];
    bvec3 down = lessThan(c.d, vec3(0.0));
    w.flip = -ivec3(down);
    w.octant_shift = octant_shift_of(down);
    w.o = mix(c.o, float(w.grid << LDC_NODE_SHIFT) - c.o, down);
    w.d = abs(c.d);
    w.inverse = 1.0 / w.d;
    w.scale = c.scale;
    w.begin = c.begin;
    w.s_min = r.t_min * c.scale - w.begin;
    w.s = w.s_min;
    w.s_limit = min(end * c.scale, 1e30) - w.begin;
    w.s_end = w.s_limit;
    float cells = float(w.grid << LDC_NODE_SHIFT);
    vec3 lower = ldc_lower[CUBE(w.cube)], upper = ldc_upper[CUBE(w.cube)];
    vec3 first = lower;
    lower = mix(lower, cells - upper, down);
    upper = mix(upper, cells - first, down);
    clip(w.s, w.s_end, w.o, w.inverse, lower, upper);
    w.s_end = c.scale > 0.0 ? w.s_end : -1e30;
    w.cell = clamp(ivec3(w.o + w.s * w.d), ivec3(lower), ivec3(upper) - 1);
    w.at = node_at(w, w.cell);
    w.shift = 2;
}

// Tests one of the 64 parts of the current node or block, and enters or passes it; an occupied cell becomes `found` and
// is passed.
void step_on(inout cell_traversal w, inout found_cell found, bvec3 down)
{
        uvec4 words = texelFetch(ldc_nodes, w.at);
        uvec3 b = uvec3(cube_cell(w, w.cell)) >> w.shift;
        uint bit = part_bit(b);
        bool upper_half = (b.z & 2u) != 0u;
        uint word = upper_half ? words.y : words.x;
        bool is_set = (word >> bit & 1u) != 0u;
        uint rank = uint(bitCount(word & ((1u << bit) - 1u))) + (upper_half ? uint(bitCount(words.x)) : 0u);
        if (is_set && w.shift != 0) {
            w.at = int(words.z + rank);
            w.shift = 0;
        } else {
            found.cell = w.cell;
            found.entry = is_set ? words.z + rank : LDC_ENTRY_NONE;
            // Passes the empty parts ahead.
            int parts = parts_to_pass(words.xy, b & 3u, down);
            ivec3 border = ((w.cell >> w.shift) + parts) << w.shift, end = ((w.cell >> (w.shift + 2)) + 1) << (w.shift + 2);
            border = min(border, end);
            int empty = int(words.z >> w.octant_shift & BLOCK_REACH_MAX);
            ivec3 away = ((w.cell >> LDC_NODE_SHIFT) + (empty > 0 ? empty : 1)) << LDC_NODE_SHIFT;
            border = (words.x | words.y) == 0u ? away : border;
            vec3 exits = (vec3(border) - w.o) * w.inverse;
            float s_out = nearest_exit(exits);
            ivec3 next = cell_behind(w.o, w.d, s_out, exits, w.cell, border);
            ivec3 others = (next ^ w.cell) >> (w.shift + 2);
            bool leaves = (others.x | others.y | others.z) != 0;
            w.cell = next;
            w.s = w.s < s_out ? s_out : w.s;
            w.s = any(greaterThanEqual(next, ivec3(w.grid << LDC_NODE_SHIFT))) ? 1e30 : w.s;
            w.shift = leaves ? 2 : w.shift;
            w.at = leaves ? node_at(w, next) : w.at;
        }
}

// Advances up to two steps towards the next occupied cell. The lanes of a SIMD group wait for the slowest, so cells are
// tested after few steps: with four steps rays are a seventh slower, with one a tenth, with a loop up to the next cell a
// fifth.
found_cell next_cell(inout cell_traversal w)
{
    found_cell found = found_cell(ivec3(0), LDC_ENTRY_NONE);
    bvec3 down = notEqual(w.flip, ivec3(0));
    step_on(w, found, down);
    if (w.s < w.s_end && found.entry == LDC_ENTRY_NONE)
        step_on(w, found, down);
    return found;
}

void test_cell_sample(inout cell_traversal w, int axis, ivec3 cell, uint sample_index, float depth, uint normal_bits,
                      inout ldc_found found)
{
    vec3 flipped = vec3(w.flip);
    vec3 normal = direction_from_octahedral(normal_bits) * (1.0 + 2.0 * flipped);
    float flip_depth = in_image(flipped, axis).z;
    float turned = flip_depth < 0.0 ? float(w.grid << LDC_NODE_SHIFT) - depth : depth;
    float s, side, beside;
    if (intersect_sample(in_image(w.o, axis), in_image(w.d, axis), w.cube, in_image(vec3(cell), axis).xy, turned,
                         in_image(normal, axis), s, side, beside) &&
        beside <= BESIDE_MAX && s > w.s_min && s < w.s_limit) {
        offer_sample(found, sample_index, (s + w.begin) / w.scale, side, 1.0 / w.scale);
#ifdef LDC_EXACT
        w.is_within = beside <= LDC_SLACK;
#endif
        w.s_limit = found.end * w.scale - w.begin;
    }
}

void test_cell(inout cell_traversal w, found_cell at, inout ldc_found found)
{
    uint entry = at.entry;
    do {
        uvec4 e = texelFetch(ldc_entries, int(entry));
        test_cell_sample(w, int(e.x >> LDC_ENTRY_AXIS_SHIFT), at.cell, e.x & LDC_ENTRY_SAMPLE_MASK,
                         uintBitsToFloat(e.z), e.w, found);
        entry = e.y;
    } while (entry != 0u);
    w.s_end = w.s_end < w.s_limit ? w.s_end : w.s_limit;
}

#endif
