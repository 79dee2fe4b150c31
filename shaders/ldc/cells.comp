// SPDX-License-Identifier: MIT
// Finds the cells that planes of samples pass, and makes the nodes, blocks and entries of ldc/layout.h.
//
// Defines, one of them:
//   CELLS_LIST     records each sample's texel; an item is a texel of the images
//   CELLS_BLOCKS   marks the blocks that samples are in; an item is a sample
//   CELLS_PLACE    gives nodes their blocks; an item is a node
//   CELLS_MARK     marks cells; an item is a sample
//   CELLS_COUNT    gives blocks their entries; an item is a block
//   CELLS_FILL     writes the first entry of each cell; an item is a sample
//   CELLS_FURTHER  writes the further entries of cells; an item is such an entry
//   CELLS_SORT     sorts the entries of cells that have several; an item is a further entry
// After them raster/reach.comp adds the empty space round empty nodes.
#include "ldc/layout.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"
#include "ldc/plane.glsl"

uniform int first_node, grid; // nodes along a side

layout(std430, binding = BIND_TRACER_0) buffer count_block {
    uvec4 lower, upper; // occupied nodes
    uvec4 unused[2];    // padding: all passes write the words after it and read those before
    uint block_count;
    uint entry_count;   // entries of cells, the first one of each
    uint further_count; // further entries of cells
    uint padding;
} counts;

// Record of a sample: 12 bits of its texel's u, 12 of v, its axis; then a bit for each of up to four cells, in ascending
// depth: the sample came first and has the cell's own entry. Records of further entries follow those of all samples: the
// sample, and which of its cells.
const uint LIST_CELL_SHIFT = 30u, LIST_SAMPLE_MASK = 0x3fffffffu;
const uint LIST_V_SHIFT = 12u, LIST_AXIS_SHIFT = 24u, LIST_FIRST_SHIFT = 26u, LIST_MASK = 0xfffu;

#ifdef CELLS_LIST

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer ldc_texels;
layout(binding = IMAGE_LDC_NODES, r32ui) writeonly uniform uimageBuffer list;

uniform int first_texel, resolution;
uniform uint first_sample;

void main()
{
    int item = int(item_index()), of_image = resolution * resolution;
    if (item >= 3 * of_image)
        return;
    int axis = item / of_image, in_image_ = item - axis * of_image;
    int v = in_image_ / resolution, u = in_image_ - v * resolution;
    uvec2 words = texelFetch(ldc_texels, first_texel + item).xy;
    uint place = uint(u) | uint(v) << LIST_V_SHIFT | uint(axis) << LIST_AXIS_SHIFT;
    uint first = words.x - first_sample;
    for (uint i = first; i < first + (words.y & LDC_TEXEL_COUNT_MASK); i++)
        imageStore(list, int(i), uvec4(place));
}

#elif defined CELLS_BLOCKS || defined CELLS_MARK || defined CELLS_FILL || defined CELLS_FURTHER || defined CELLS_SORT

layout(binding = UNIT_TRACER_0) uniform usamplerBuffer list;
layout(binding = UNIT_TRACER_1) uniform usamplerBuffer ldc_geometry;
#if defined CELLS_BLOCKS || defined CELLS_MARK
layout(binding = IMAGE_LDC_NODES, r32ui) uniform uimageBuffer nodes; // words
#else
layout(binding = UNIT_TRACER_2) uniform usamplerBuffer nodes_; // for passes that only read them, which is faster
#endif

#ifdef CELLS_MARK
layout(binding = IMAGE_LDC_ENTRIES, r32ui) writeonly uniform uimageBuffer listed; // the list
#elif defined CELLS_FILL
layout(binding = IMAGE_LDC_ENTRIES, rgba32ui) writeonly uniform uimageBuffer entries;
#elif defined CELLS_FURTHER || defined CELLS_SORT
layout(binding = IMAGE_LDC_ENTRIES, r32ui) uniform uimageBuffer entries; // words
#endif

uniform int resolution;
uniform uint first_sample, sample_count, first_further, item_count;

int node_of(ivec3 cell)
{
    ivec3 n = cell >> LDC_NODE_SHIFT;
    return first_node + (n.z * grid + n.y) * grid + n.x;
}

#ifdef CELLS_BLOCKS

void mark_block(ivec3 cell)
{
    uvec3 b = uvec3(cell);
    uint bit = 1u << ((b.x >> 2 & 3u) | (b.y & 12u) | (b.z & 4u) << 2);
    int word = 4 * node_of(cell) + int(b.z >> 3 & 1u);
    if ((imageLoad(nodes, word).x & bit) == 0u)
        imageAtomicOr(nodes, word, bit);
}

#else

uint bit_of(uvec3 part)
{
    return (part.x & 3u) | (part.y & 3u) << 2 | (part.z & 1u) << 4;
}

uvec3 words_at(int at)
{
#ifdef CELLS_MARK
    return uvec3(imageLoad(nodes, 4 * at).x, imageLoad(nodes, 4 * at + 1).x, imageLoad(nodes, 4 * at + 2).x);
#else
    return texelFetch(nodes_, at).xyz;
#endif
}

// Place of a part's data in a node or a block: behind those of all occupied parts before it.
uint place_of(uvec3 words, uvec3 part)
{
    uint below = (1u << bit_of(part)) - 1u;
    bool upper_half = (part.z & 2u) != 0u;
    return words.z + uint(bitCount((upper_half ? words.y : words.x) & below)) +
           (upper_half ? uint(bitCount(words.x)) : 0u);
}

int block_of(ivec3 cell)
{
    return int(place_of(words_at(node_of(cell)), uvec3(cell) >> 2));
}

uint entry_of(ivec3 cell)
{
    return place_of(words_at(block_of(cell)), uvec3(cell));
}

#endif

struct listed_sample {
    uint index, place; // place of its record
    int axis, u, v, first, last; // texel, depths of its cells
    uvec2 geometry;
};

listed_sample sample_at(uint item)
{
    listed_sample s;
    s.index = first_sample + item;
    s.place = texelFetch(list, int(item)).x;
    s.geometry = texelFetch(ldc_geometry, int(s.index)).xy;
    s.axis = int(s.place >> LIST_AXIS_SHIFT & 3u);
    s.u = int(s.place & LIST_MASK);
    s.v = int(s.place >> LIST_V_SHIFT & LIST_MASK);
    float depth = uintBitsToFloat(s.geometry.x), reach = plane_reach(s.geometry.y, s.axis);
    s.first = int(clamp(depth - reach, 0.0, float(resolution - 1)));
    s.last = int(clamp(depth + reach, 0.0, float(resolution - 1)));
    return s;
}

ivec3 cell_of(listed_sample s, int k)
{
    return s.axis == 0 ? ivec3(k, s.u, s.v) : s.axis == 1 ? ivec3(s.v, k, s.u) : ivec3(s.u, s.v, k);
}

uint packed_entry(listed_sample s)
{
    return s.index | uint(s.axis) << LDC_ENTRY_AXIS_SHIFT;
}

#if defined CELLS_BLOCKS

void handle(uint item)
{
    listed_sample s = sample_at(item);
    for (int k = s.first; k <= (s.last | 3); k += 4)
        mark_block(cell_of(s, k));
}

#elif defined CELLS_MARK

void handle(uint item)
{
    listed_sample s = sample_at(item);
    for (int k = s.first; k <= s.last; k++) {
        ivec3 cell = cell_of(s, k);
        uint bit = 1u << bit_of(uvec3(cell)), number = uint(k - s.first);
        if ((imageAtomicOr(nodes, 4 * block_of(cell) + (cell.z >> 1 & 1), bit) & bit) == 0u)
            s.place |= 1u << (LIST_FIRST_SHIFT + number);
        else
            imageStore(listed, int(sample_count + atomicAdd(counts.further_count, 1u)),
                       uvec4(item | number << LIST_CELL_SHIFT));
    }
    imageStore(listed, int(item), uvec4(s.place));
}

#elif defined CELLS_FILL

void handle(uint item)
{
    listed_sample s = sample_at(item);
    for (int k = s.first; k <= s.last; k++)
        if ((s.place >> (LIST_FIRST_SHIFT + uint(k - s.first)) & 1u) != 0u)
            imageStore(entries, int(entry_of(cell_of(s, k))), uvec4(packed_entry(s), 0u, s.geometry));
}

#else

// First entry of the cell of a further entry.
uint first_entry_of(uint item, out listed_sample s)
{
    uint noted = texelFetch(list, int(sample_count + item)).x;
    s = sample_at(noted & LIST_SAMPLE_MASK);
    return entry_of(cell_of(s, s.first + int(noted >> LIST_CELL_SHIFT)));
}

#ifdef CELLS_SORT

uint next_of(uint entry)
{
    return imageLoad(entries, int(4u * entry + 1u)).x;
}

void swap_words(uint a, uint b, uint word)
{
    uint of_a = imageLoad(entries, int(4u * a + word)).x;
    imageStore(entries, int(4u * a + word), imageLoad(entries, int(4u * b + word)));
    imageStore(entries, int(4u * b + word), uvec4(of_a));
}

// Samples arrive in random order, and where a ray intersects two at the same distance, the first counts: they are sorted
// by axis and sample, so that the same scene gives the same picture. The last entry of a cell sorts them all.
void handle(uint item)
{
    if (next_of(first_further + item) != 0u)
        return;
    listed_sample s;
    uint here = first_entry_of(item, s);
    for (uint next = next_of(here); next != 0u; here = next, next = next_of(here)) {
        uint min_place = here, min_key = imageLoad(entries, int(4u * here)).x;
        for (uint k = next; k != 0u; k = next_of(k)) {
            uint key = imageLoad(entries, int(4u * k)).x;
            min_place = key < min_key ? k : min_place;
            min_key = key < min_key ? key : min_key;
        }
        if (min_place != here) {
            swap_words(here, min_place, 0u);
            swap_words(here, min_place, 2u);
            swap_words(here, min_place, 3u);
        }
    }
}

#else

// Inserts an entry in front of the cell's further entries.
void handle(uint item)
{
    listed_sample s;
    uint entry = first_entry_of(item, s), here = first_further + item;
    imageStore(entries, int(4u * here), uvec4(packed_entry(s)));
    imageStore(entries, int(4u * here + 1u), uvec4(imageAtomicExchange(entries, int(4u * entry + 1u), here)));
    imageStore(entries, int(4u * here + 2u), uvec4(s.geometry.x));
    imageStore(entries, int(4u * here + 3u), uvec4(s.geometry.y));
}

#endif

#endif

void main()
{
    uint item = item_index();
    if (item < item_count)
        handle(item);
}

#else

layout(binding = IMAGE_LDC_NODES, rgba32ui) uniform uimageBuffer nodes;

#ifdef CELLS_COUNT

uniform uint first_entry;
uniform int blocks;

void main()
{
    int item = int(item_index());
    if (item >= blocks)
        return;
    int at = first_node + grid * grid * grid + item;
    uvec4 block = imageLoad(nodes, at);
    block.z = first_entry + atomicAdd(counts.entry_count, uint(bitCount(block.x) + bitCount(block.y)));
    imageStore(nodes, at, block);
}

#else

void settle(int at, ivec3 place)
{
    uvec4 node = imageLoad(nodes, at);
    uint count = uint(bitCount(node.x) + bitCount(node.y));
    if (count > 0u) {
        node.z = uint(first_node + grid * grid * grid) + atomicAdd(counts.block_count, count);
        uvec3 at_node = uvec3(place);
        for (int k = 0; k < 3; k++) {
            if (at_node[k] < counts.lower[k])
                atomicMin(counts.lower[k], at_node[k]);
            if (at_node[k] > counts.upper[k])
                atomicMax(counts.upper[k], at_node[k]);
        }
    }
    imageStore(nodes, at, node);
}

void main()
{
    int item = int(item_index());
    if (item >= grid * grid * grid)
        return;
    settle(first_node + item, ivec3(item % grid, item / grid % grid, item / (grid * grid)));
}

#endif

#endif
