// SPDX-License-Identifier: MIT
// Places of the quadtrees' nodes and the meaning of their 64 bits (quadtree/layout.h).
#include "quadtree/layout.h"

layout(std140, binding = UNIFORM_QUADTREE) uniform quadtree_block { quadtree_uniforms quadtree; };

// Whether the face is a single view, beside which nothing is known; beside the faces of a cube there is nothing.
#ifdef QUADTREE_VIEW
#define IS_VIEW true
#define FACES 1u
#define FACE(face) 0u
#else
#define IS_VIEW false
#define FACES quadtree.faces
#define FACE(face) (face)
#endif

// Index of the first node of a level within its slice. A slice is a multiple of 4^QUADTREE_TOP texels, so the sum S + S /
// 4 + S / 16 .. of the levels below has no remainder. A third of a multiple of 3 is a product.
uint node_level_first(uint level)
{
    uint texels = quadtree.padded_width * quadtree.padded_height;
    return (texels - (texels >> (2u * level))) * 0xaaaaaaabu * 4u;
}

// Index of node `place` (column, row) of a level. Within a slice it grows by node_row(level) from row to row.
uint node_row(uint level)
{
    return quadtree.padded_width >> level;
}

uint node_index(uint slice, uint level, uvec2 place)
{
    return slice * quadtree.slice_nodes + node_level_first(level) + place.y * node_row(level) + place.x;
}

// Index of a face's own entry, behind the nodes.
uint face_index(uint face)
{
    return quadtree.faces * quadtree.layers * quadtree.slice_nodes + face;
}

// Centre of a node, in texel coordinates of the face.
vec2 node_centre(uint level, uvec2 place)
{
    return (vec2(place) + 0.5) * float(1u << level);
}

bool node_is_plane(uvec2 node)
{
    return int(node.x) < 0;
}

// ---- planes ----

// w at the node's centre; 0: there is no surface.
float plane_w(uvec2 node)
{
    return uintBitsToFloat(node.x & 0x7ffffffeu);
}

// dw / dx and dw / dy, per texel.
vec2 plane_slopes(uvec2 node)
{
    return unpackHalf2x16(node.y) * (1.0 / QUADTREE_SLOPE_SCALE);
}

// The paper's flag O.
bool plane_is_at_edge(uvec2 node)
{
    return (node.x & 1u) != 0u;
}

// First words of planes without flags; `w` not negative.
uvec4 plane_heads(vec4 w)
{
    return (floatBitsToUint(w) & 0x7ffffffeu) | 0x80000000u;
}

// Slopes beyond the range of half floats are limited to it.
uint plane_tail(vec2 slopes)
{
    return packHalf2x16(clamp(slopes * QUADTREE_SLOPE_SCALE, vec2(-QUADTREE_SLOPE_MAX), vec2(QUADTREE_SLOPE_MAX)));
}

uvec2 plane_node(float w, vec2 slopes, bool at_edge)
{
    return uvec2(plane_heads(vec4(w)).x | uint(at_edge), plane_tail(slopes));
}

// ---- boxes ----

// Maximum and minimum w of the surfaces.
vec2 box_range_of_surfaces(uvec2 node)
{
    return uintBitsToFloat(node & 0x7fffffffu);
}

// Whether the box has gaps, where there is no surface.
bool box_has_gaps(uvec2 node)
{
    return int(node.y) < 0;
}

// Maximum and minimum w.
vec2 box_range(uvec2 node)
{
    return box_has_gaps(node) ? vec2(uintBitsToFloat(node.x), 0.0) : uintBitsToFloat(node);
}

// Node of a box round surfaces.
uvec2 box_node(float w_max, float w_min, bool has_gaps)
{
    return floatBitsToUint(vec2(w_max, w_min)) & 0x7fffffffu | uvec2(0u, has_gaps ? 0x80000000u : 0u);
}
