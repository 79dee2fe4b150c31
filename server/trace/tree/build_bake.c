// SPDX-License-Identifier: MIT
#include "trace/tree/build.h"

#include "base/parallel.h"
#include "base/progress.h"

#include <stdlib.h>

/* An inner node whose surface is at least this share of its nearest kept ancestor's is removed: its children
 * become that ancestor's. A node with two children saves two tests where it is missed and costs one whenever it is
 * reached, so by the heuristic it pays below one half. Measured at 0.5, 0.6, 0.7, 0.85 and never: boxes hardly
 * care (2 %), spheres lose 10 % where nothing is thrown back, and 0.5 leaves a fifth fewer elements. */
#define THROW_BACK 0.5f

/* Octants are ordered four at a time, one in each lane. */
#define LANES 4
typedef uint32_t lanes __attribute__((vector_size(LANES * sizeof(uint32_t))));

struct bake {
    struct bvh_baked *baked;
    const struct bvh_binary_node *nodes;
    uint32_t place_count; /* of the binary tree */
    uint32_t *element;    /* of each binary node; of inner nodes that are thrown back BVH_NONE */
    uint32_t *below;      /* elements of each binary node's subtree */
    uint32_t waiting_max; /* maximum of right children that wait during a traversal */
    bool failed[BVH_OCTANTS / LANES];
};

static bool node_is_leaf(const struct bvh_binary_node *node)
{
    return node->count_axis >> 2 > 0;
}

/* In depth-first order: which nodes are kept, and their new parents. */
static void choose_elements(struct bake *bake, const float *areas)
{
    struct bvh_baked *baked = bake->baked;
    uint32_t elements = 0, waiting = 0;
    uint32_t *above = bake->element; /* the nearest kept ancestor, until the node itself is reached */
    above[0] = BVH_NONE;
    for (uint32_t i = 0; i < bake->place_count; i = bvh_binary_next(bake->nodes, i)) {
        const struct bvh_binary_node *node = &bake->nodes[i];
        uint32_t parent = above[i];
        /* written so that areas which are not numbers keep their node */
        bool pays = i == 0 || node_is_leaf(node) || !(areas[i] >= THROW_BACK * areas[baked->node[parent]]);
        if (pays) {
            baked->node[elements] = i;
            baked->parent[elements] = parent;
            baked->size[elements] = 1;
            parent = elements++;
        }
        if (node_is_leaf(node)) {
            waiting -= waiting > 0;
        } else {
            above[i + 1] = above[node->link] = parent;
            waiting++;
            if (waiting > bake->waiting_max)
                bake->waiting_max = waiting;
        }
        bake->element[i] = pays ? parent : BVH_NONE;
    }
    baked->element_count = elements;
    for (uint32_t e = elements - 1; e > 0; e--)
        baked->size[baked->parent[e]] += baked->size[e];
}

/* All ones in the lanes of octants that meet the left child of a node first: its axis is positive there. */
static lanes left_is_near(const struct bvh_binary_node *node, uint32_t first_octant)
{
    const lanes octants = {first_octant, first_octant + 1, first_octant + 2, first_octant + 3};
    return (lanes)((octants >> (node->count_axis & 3) & 1) == 0);
}

static lanes choose(lanes which, lanes yes, lanes no)
{
    return (yes & which) | (no & ~which);
}

/* Elements below each binary node. A right child's place comes after its left sibling's and all below that: going
 * backwards, both children are done before their parent. The binary nodes' places have gaps, whence the list. */
static bool count_below(struct bake *bake)
{
    uint32_t count = 0;
    uint32_t *order = malloc(bake->place_count * sizeof(*order));
    if (!order)
        return false;
    for (uint32_t i = 0; i < bake->place_count; i = bvh_binary_next(bake->nodes, i))
        order[count++] = i;
    while (count-- > 0) {
        uint32_t i = order[count];
        const struct bvh_binary_node *node = &bake->nodes[i];
        bake->below[i] = bake->element[i] != BVH_NONE;
        if (!node_is_leaf(node))
            bake->below[i] += bake->below[i + 1] + bake->below[node->link];
    }
    free(order);
    return true;
}

/* The places of all elements in four octants' orders, in one traversal that carries where the subtree it is in
 * begins: its own element first, then all of the nearer child, then all of the farther one. */
static void place_octants(void *context, uint32_t group)
{
    struct bake *bake = context;
    uint32_t first_octant = group * LANES, waiting = 0;
    size_t count = bake->baked->element_count;
    uint32_t *places = bake->baked->place + first_octant * count;
    lanes begin = {0, 0, 0, 0};
    lanes *begin_right = aligned_alloc(sizeof(begin), ((size_t)bake->waiting_max + 1) * sizeof(begin));
    bake->failed[group] = !begin_right;
    if (!begin_right)
        return;
    for (uint32_t i = 0; i < bake->place_count; i = bvh_binary_next(bake->nodes, i)) {
        const struct bvh_binary_node *node = &bake->nodes[i];
        uint32_t element = bake->element[i];
        if (element != BVH_NONE) {
            for (uint32_t lane = 0; lane < LANES; lane++)
                places[lane * count + element] = begin[lane];
            begin += 1;
        }
        if (node_is_leaf(node)) {
            if (waiting > 0)
                begin = begin_right[--waiting];
            continue;
        }
        const lanes none = {0}, left = none + bake->below[i + 1], right = none + bake->below[node->link];
        lanes left_first = left_is_near(node, first_octant);
        begin_right[waiting++] = begin + choose(left_first, left, none);
        begin += choose(left_first, none, right);
    }
    free(begin_right);
}

static bool bake_alloc(struct bake *bake, struct bvh_baked *baked)
{
    size_t places = bake->place_count;
    bake->element = malloc(places * sizeof(*bake->element));
    bake->below = malloc(places * sizeof(*bake->below));
    baked->node = malloc(places * sizeof(*baked->node));
    baked->size = malloc(places * sizeof(*baked->size));
    baked->parent = malloc(places * sizeof(*baked->parent));
    return bake->element && bake->below && baked->node && baked->size && baked->parent;
}

static bool place_all(struct bake *bake, uint32_t octants, unsigned threads)
{
    struct bvh_baked *baked = bake->baked;
    if (octants == 1)
        return true;
    baked->place = malloc((size_t)octants * baked->element_count * sizeof(*baked->place));
    if (!baked->place || !count_below(bake))
        return false;
    parallel_run(threads, octants / LANES, place_octants, bake);
    for (uint32_t group = 0; group < octants / LANES; group++)
        if (bake->failed[group])
            return false;
    return true;
}

bool bvh_bake(struct bvh_baked *baked, const struct bvh_binary *tree, const float *areas, uint32_t octants,
              unsigned threads)
{
    *baked = (struct bvh_baked){0};
    struct bake bake = {.baked = baked, .nodes = tree->nodes, .place_count = 2 * tree->primitive_count - 1};
    bool ok = bake_alloc(&bake, baked);
    if (ok)
        choose_elements(&bake, areas);
    progress_tell();
    ok = ok && place_all(&bake, octants, threads);
    free(bake.element);
    free(bake.below);
    if (!ok)
        bvh_baked_finish(baked);
    return ok;
}

void bvh_baked_finish(struct bvh_baked *baked)
{
    free(baked->node);
    free(baked->size);
    free(baked->parent);
    free(baked->place);
    *baked = (struct bvh_baked){0};
}
