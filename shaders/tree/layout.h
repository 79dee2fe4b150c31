/* SPDX-License-Identifier: MIT */
/* Bounding volume trees on the device. Two levels: one tree over the primitives of each geometry, one
 * top tree over the instances; both of the same elements, traversed by links alone (no stack).
 *
 * A tree of n elements is stored BVH_OCTANTS times, once for each sign of a direction's components, each time in
 * the depth-first order that meets nearer children first. So the element after a hit is the next one, and an
 * element needs only one link: the element after a miss (after a leaf it is the next one in any case). Octant o:
 * bit 0: x is negative, 1: y, 2: z. A tree that begins at element f has octant o's copy at BVH_OCTANTS f + o n.
 * Trees that no ray traverses by its direction (trace/rayspace, and spheres) have octant 0's copy alone, at f.
 *
 * Two forms of element. Packed: boxes on a grid of 65536 cells per axis that spans the tree, one texel. Whole:
 * boxes or spheres in floats, two texels; for spheres, and for a scene with a tree that has finer detail than its
 * grid. The reason: measured on software GL with 146K triangles, a traversal step is bound by its texel fetches
 * and not by its arithmetic; elements of 32 bytes with links of 8 beside them, stored once, took three fetches per
 * step. */
#ifndef FARLIGHT_SHADERS_TREE_LAYOUT_H
#define FARLIGHT_SHADERS_TREE_LAYOUT_H
#include "shared/types.h"

/* A packed element, one texel of an RGBA32UI texel buffer. Each axis: cell of the corner that rays of this
 * octant reach first, and, times 65536, of the other corner. */
struct bvh_packed_element {
    uint corners_x, corners_y, corners_z;
    uint link;
};
SHARED_SIZE(bvh_packed_element, 16)
#define BVH_GRID_CELLS 65535u

/* A whole element, two texels. Box: lower and upper corner. Sphere: centre in `lower`, radius in `upper_x`; y
 * and z are 0. */
struct bvh_element {
    float lower_x, lower_y, lower_z;
    uint link;
    float upper_x, upper_y, upper_z;
    uint pad;
};
SHARED_SIZE(bvh_element, 32)
#define BVH_OCTANTS 8u

/* Link of an element. Kind 0: an inner element; the element after a miss, counted from the copy's first one;
 * the number of elements: the tree is finished. Other kinds: a leaf: kind (2 bits), count - 1 (3 bits), first
 * primitive in the tree's order or instance (27 bits). */
#define BVH_LEAF_KIND_SHIFT 30u
#define BVH_LEAF_TRIANGLES 1u
#define BVH_LEAF_SPHERES 2u
#define BVH_LEAF_INSTANCE 3u
#define BVH_LEAF_COUNT_SHIFT 27u
#define BVH_LEAF_COUNT_MASK 7u
#define BVH_LEAF_FIRST_MASK 0x07ffffffu
#define BVH_LEAF_MAX 8u /* primitives */

/* A wide node: the boxes of up to eight children, of a byte per plane, in cells of the node's own that are powers
 * of two wide. Ylitie, Karras, Laine, Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs, HPG
 * 2017, section 3.1. Five texels of an RGBA32UI texel buffer, stored once: a child lies in the slot whose number
 * is the octant of directions that meet it first, so that a ray of octant o visits slots by descending slot ^ ~o.
 */
struct bvh_wide_node {
    float origin_x, origin_y, origin_z; /* lower corner */
    /* Bytes 0..2: exponents of the cells' width along x, y, z, signed; byte 3: a bit for each inner child. */
    uint exponents;
    uint first_child;     /* node of the first inner child; the others follow in the order of their slots */
    uint first_primitive; /* first one of the leaves */
    /* A byte a slot. 0: empty; inner child: 0x20 | 24 + slot; leaf: bits 5..7: its primitives in unary, bits 0..4:
     * place of the first one behind first_primitive. */
    uint meta_0123, meta_4567;
    uvec4 planes[3]; /* a byte a slot: lower planes, x of slots 0..3, of 4..7, y, z; then upper ones */
};
SHARED_SIZE(bvh_wide_node, 80)
#define BVH_WIDE_TEXELS 5u
#define BVH_WIDE_SLOTS 8u
#define BVH_WIDE_LEAF_MAX 3u /* primitives of a child */
#define BVH_WIDE_INNER 0x20u
/* Maximum of levels: a traversal remembers one group of children a level. */
#define BVH_WIDE_DEPTH_MAX 28u

/* Transform element: the data for entering an instance. Texels of an RGBA32UI buffer. */
struct bvh_transform {
    vec4 object_from_world[3];
    /* Object space; packed elements count cells from here. Of wide nodes: the largest coordinates by magnitude. */
    float grid_lower_x, grid_lower_y, grid_lower_z;
    uint close_texels;    /* offset from a triangle to itself at shutter close; 0: the shape stays meanwhile */
    vec4 cells_per_unit;  /* w unused */
    uint first_element;   /* first element of the geometry's tree, in the element buffer */
    uint element_count;   /* elements of the tree; the kind of the leaves where it has wide nodes */
    uint first_texel;     /* first texel of the geometry's primitives, in the primitive buffer */
    uint first_primitive; /* scene-wide */
};
SHARED_SIZE(bvh_transform, 96)
#define BVH_TRANSFORM_TEXELS 6

/* Primitives in the order of the leaves, fetched without an index. RGBA32UI, though most words are floats: a
 * driver may flush a small integer, which is a denormal as a float. Texels:
 *   triangle  3 texels: corners; w of the first: bits of the primitive's number in its geometry
 *   sphere    2 texels: centre and radius; x of the second: bits of the number
 * Triangles of a geometry that deforms are stored twice: all at shutter open, then all at shutter close. */
#define BVH_TRIANGLE_TEXELS 3u
#define BVH_SPHERE_TEXELS 2u

/* Input of the refit of a deformed geometry's tree (shaders/tree/refit_bounds.comp): an element. Texels of an
 * RGBA32UI buffer, elements in the order of their height above the leaves. */
struct bvh_refit_record {
    uint element; /* in the order of octant 0, in which a node's children follow it */
    uint size;    /* elements of its subtree, itself included */
    uint leaf;    /* its link, 0: an inner one */
    uint pad;
    uvec4 places_0123, places_4567; /* places in the order of each octant */
};
SHARED_SIZE(bvh_refit_record, 48)
#define BVH_REFIT_TEXELS 3
/* Box of an element during a refit: texels of 4 words, in the order of octant 0: lower corner and the size of
 * its subtree; upper corner; (floats) surfaces of all boxes of its subtree, and of each of its triangles' own
 * box. */
#define BVH_REFIT_BOX_TEXELS 3u

#endif
