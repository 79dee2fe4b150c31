// SPDX-License-Identifier: MIT
// Traversal image by image: a DDA through an image's nodes enters the children where the ray's depths meet the node's
// range, and goes to the next node where they do not. Paper, section 1.4.
//
// The image of the ray's dominant axis comes first, as the ray passes the fewest of its texels; an intersection in one
// image ends the ray in the next.
//
// Four of a texel's samples are tested at once (paper, section 4).
#include "ldc/found.glsl"

#ifndef LDC_CELLS

layout(binding = UNIT_TRACER_4) uniform samplerBuffer ldc_ranges; // minimum and maximum depth of blocks

uniform int ldc_row[LDC_CUBES]; // blocks

struct image_traversal {
    vec3 o, d; // cells of the image
    vec2 inverse;
    float s, s_end;
    float s_min, s_limit; // range in which intersections count
    float begin, scale; // those of cell_ray
    ivec2 texel;
    int level; // 0: texels; 1: blocks
    int cube, axis;
};

// Begins image number `pass` of all cubes for a ray; if the ray misses it, s >= s_end.
void begin_image(trace_ray r, float end, int pass, out image_traversal w)
{
    w.cube = pass / 3;
    int rank = pass - 3 * w.cube;
    cell_ray c = cube_ray_of(r, w.cube);
    vec3 size = abs(c.d);
    int longest = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
    int shortest = size.z < size.y ? (size.z < size.x ? 2 : 0) : (size.y < size.x ? 1 : 0);
    shortest = shortest == longest ? (longest + 1) % 3 : shortest;
    w.axis = rank == 0 ? longest : rank == 2 ? shortest : 3 - longest - shortest;
    w.o = in_image(c.o, w.axis);
    w.d = in_image(c.d, w.axis);
    vec3 inverse = 1.0 / w.d;
    w.inverse = inverse.xy;
    w.scale = c.scale;
    w.begin = c.begin;
    w.s_min = r.t_min * c.scale - w.begin;
    w.s = w.s_min;
    w.s_limit = min(end * c.scale, 1e30) - w.begin;
    w.s_end = w.s_limit;
    int resolution = ldc_resolution[CUBE(w.cube)];
    float cells = float(resolution);
    clip(w.s, w.s_end, w.o, inverse, vec3(0.0, 0.0, -LDC_SPAN), vec3(cells, cells, cells + LDC_SPAN));
    w.s_end = c.scale > 0.0 && resolution > 0 ? w.s_end : -1e30;
    w.texel = clamp(ivec2(floor(w.o.xy + w.s * w.d.xy)), ivec2(0), ivec2(resolution - 1));
    w.level = 1;
}

int block_index(image_traversal w)
{
    int row = ldc_row[CUBE(w.cube)];
    ivec2 block = w.texel >> LDC_BLOCK_SHIFT;
    return ldc_first_node[CUBE(w.cube)] + (w.axis * row + block.y) * row + block.x;
}

// Exit of the ray from its current node of a level, and the side of the exit.
float node_exit(image_traversal w, int shift, out bool by_u)
{
    ivec2 first = w.texel >> shift << shift, last = first + ((1 << shift) - 1);
    vec2 exits = vec2(w.d.x >= 0.0 ? last.x + 1 : first.x, w.d.y >= 0.0 ? last.y + 1 : first.y);
    exits = (exits - w.o.xy) * w.inverse;
    by_u = exits.x < exits.y;
    return by_u ? exits.x : exits.y;
}

// Leaves that node, in integers, so that each step advances.
void leave_node(inout image_traversal w, int shift, float s_out, bool by_u)
{
    ivec2 first = w.texel >> shift << shift, last = first + ((1 << shift) - 1);
    ivec2 next = clamp(ivec2(floor(w.o.xy + s_out * w.d.xy)), first, last);
    next = by_u ? ivec2(w.d.x >= 0.0 ? last.x + 1 : first.x - 1, next.y)
                : ivec2(next.x, w.d.y >= 0.0 ? last.y + 1 : first.y - 1);
    w.level = (next ^ w.texel) >> LDC_BLOCK_SHIFT != ivec2(0) ? 1 : w.level;
    w.texel = next;
    uint resolution = uint(ldc_resolution[CUBE(w.cube)]);
    w.s = w.s < s_out ? s_out : w.s;
    w.s = uint(next.x) >= resolution || uint(next.y) >= resolution ? 1e30 : w.s;
}

// Rounds before samples are tested: the lanes of a SIMD group wait for the slowest.
const int IMAGE_ROUNDS = 4;

// Advances towards the next texel in which the ray may hit something, for some rounds. True: it was reached.
bool next_texel(inout image_traversal w, out uvec4 words, out float z_min, out float z_max)
{
    words = uvec4(0u);
    z_min = z_max = 0.0;
    int resolution = ldc_resolution[CUBE(w.cube)];
    int first_texel = ldc_first_texel[CUBE(w.cube)] + w.axis * resolution * resolution;
    for (int round_ = 0; round_ < IMAGE_ROUNDS && w.s < w.s_end; round_++) {
        int shift = w.level * LDC_BLOCK_SHIFT;
        bool by_u;
        float s_out = node_exit(w, shift, by_u);
        float s_last = s_out < w.s_end ? s_out : w.s_end;
        float z0 = w.o.z + w.s * w.d.z, z1 = w.o.z + s_last * w.d.z;
        z_min = z0 < z1 ? z0 : z1;
        z_max = z0 < z1 ? z1 : z0;
        vec2 range;
        if (w.level == 0) {
            words = texelFetch(ldc_texels, first_texel + w.texel.y * resolution + w.texel.x);
            range = uintBitsToFloat(words.zw) + vec2(-LDC_SPAN, LDC_SPAN);
        } else {
            range = texelFetch(ldc_ranges, block_index(w)).xy;
        }
#ifdef LDC_TOLERANCE
        range += vec2(-LDC_TOLERANCE_CELLS, LDC_TOLERANCE_CELLS);
#endif
        if (z_max >= range.x && z_min <= range.y) {
            if (w.level == 0)
                return true;
            w.level--;
        } else {
            leave_node(w, shift, s_out, by_u);
        }
    }
    return false;
}

void test_sample(inout image_traversal w, uint sample_index, float depth, uint normal_bits, inout ldc_found found)
{
    vec3 normal = in_image(direction_from_octahedral(normal_bits), w.axis);
    float s, side, beside;
    if (intersect_sample(w.o, w.d, w.cube, vec2(w.texel), depth, normal, s, side, beside) && beside <= LDC_SLACK &&
        s > w.s_min && s < w.s_limit) {
        offer_sample(found, sample_index, (s + w.begin) / w.scale, side, 1.0 / w.scale);
        w.s_limit = found.end * w.scale - w.begin;
    }
}

// Tests the samples of the current texel between two depths, and leaves the texel.
void test_texel(inout image_traversal w, uvec4 words, float z_min, float z_max, inout ldc_found found)
{
    uint count = words.y & LDC_TEXEL_COUNT_MASK;
    float low = z_min - LDC_SPAN, high = z_max + LDC_SPAN;
#ifdef LDC_TOLERANCE
    low -= LDC_TOLERANCE_CELLS;
    high += LDC_TOLERANCE_CELLS;
#endif
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
            test_sample(w, sample_index, depth, texelFetch(ldc_geometry, int(sample_index)).y, found);
        }
        if (depths.w > high)
            break;
    }
    bool by_u;
    float s_out = node_exit(w, 0, by_u);
    leave_node(w, 0, s_out, by_u);
    w.s_end = w.s_end < w.s_limit ? w.s_end : w.s_limit;
}

#endif
