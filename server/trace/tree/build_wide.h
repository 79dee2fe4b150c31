/* SPDX-License-Identifier: MIT */
/* Makes a tree of wide nodes (struct bvh_wide_node) from a binary one: the cut of its nodes into groups of up to
 * eight children that costs a ray least. Ylitie, Karras, Laine, Efficient Incoherent Ray Traversal on GPUs Through
 * Compressed Wide BVHs, HPG 2017, section 3. Private to the builder. */
#ifndef FARLIGHT_TRACE_TREE_BUILD_WIDE_H
#define FARLIGHT_TRACE_TREE_BUILD_WIDE_H

#include "trace/tree/build.h"

/* Elements are the wide nodes and the leaves below them, in depth-first order: the children of one follow it, each
 * with its subtree, in the order of their slots. */
struct bvh_wide {
    uint32_t node_count;
    uint32_t *element; /* the element of each node */
    uint32_t *link;    /* each element's node; a leaf's bvh_leaf() with its primitives */
    uint8_t *slot;     /* each element's slot in its parent */
};

/* Costs of the binary tree: its leaves are single primitives, of which the cut makes larger ones. */
extern const struct bvh_costs bvh_wide_costs;

enum bvh_wide_result { BVH_WIDE_MADE, BVH_WIDE_TOO_DEEP, BVH_WIDE_NO_MEMORY };

/* Cuts the tree, and fills *baked with its elements. Primitives get the order of the nodes: tree->order changes,
 * and the tree's leaves are of no use any more. `kind`: of the leaves. BVH_WIDE_TOO_DEEP: it would have more than
 * BVH_WIDE_DEPTH_MAX levels. */
enum bvh_wide_result bvh_wide_make(struct bvh_wide *wide, struct bvh_baked *baked, struct bvh_binary *tree,
                                   uint32_t kind);
void bvh_wide_finish(struct bvh_wide *wide);
/* Writes node n in the device's layout; bounds are those of the elements' binary nodes, padded. */
void bvh_wide_write(struct bvh_wide_node *out, uint32_t n, const struct bvh_wide *wide,
                    const struct bvh_baked *baked, const struct bvh_binary *tree);

#endif
