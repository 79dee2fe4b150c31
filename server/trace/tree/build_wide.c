// SPDX-License-Identifier: MIT
/* Wide nodes: the cut, the slots of the children, and boxes in bytes. */
#include "trace/tree/build_wide.h"

#include "base/progress.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SLOTS BVH_WIDE_SLOTS
/* Cost of a primitive's test where that of a node is 1, as in the paper. */
#define PRIMITIVE_COST 0.3f
#define CELLS 255

const struct bvh_costs bvh_wide_costs = {.element = 1, .leaf_max = BVH_WIDE_LEAF_MAX};

/* The best ways to cut the subtree of a binary node. A forest: what stands in neighbouring slots of one wide node.
 */
struct cut {
    float costs[SLOTS - 1];  /* the least cost of a forest of at most i + 1 trees */
    uint8_t left[SLOTS - 1]; /* trees of the left child; 0: as many as of the forest of one less. left[0]: of the
                                eight of its own node */
    uint8_t count;           /* its primitives, if they fit a leaf; otherwise more than BVH_WIDE_LEAF_MAX */
    bool is_leaf;
};

static bool is_binary_leaf(const struct bvh_binary_node *node)
{
    return node->count_axis >> 2 > 0;
}

/* Cheapest forest of `trees` trees, at least 2, from both children. */
static float share_trees(const struct cut *left, const struct cut *right, uint32_t trees, uint8_t *of_left)
{
    float best = INFINITY;
    *of_left = 1; /* where all costs are NaN or infinite */
    for (uint32_t l = 1; l < trees; l++) {
        const float cost = left->costs[l - 1] + right->costs[trees - l - 1];
        if (cost < best) {
            best = cost;
            *of_left = (uint8_t)l;
        }
    }
    return best;
}

static void find_cut(struct cut *cuts, const struct bvh_binary *tree, uint32_t n)
{
    const struct bvh_binary_node *node = &tree->nodes[n];
    struct cut *cut = &cuts[n];
    const float area = tree->areas[n];
    *cut = (struct cut){.count = 1, .is_leaf = true};
    if (is_binary_leaf(node)) {
        cut->count = (uint8_t)(node->count_axis >> 2);
        for (uint32_t k = 0; k < SLOTS - 1; k++)
            cut->costs[k] = area * (float)cut->count * PRIMITIVE_COST;
        return;
    }
    const struct cut *left = &cuts[node->link], *right = &cuts[node->link + 1];
    const uint32_t count = (uint32_t)left->count + right->count;
    cut->count = (uint8_t)(count <= BVH_WIDE_LEAF_MAX ? count : BVH_WIDE_LEAF_MAX + 1);
    const float as_leaf = count <= BVH_WIDE_LEAF_MAX ? area * (float)count * PRIMITIVE_COST : INFINITY;
    const float as_node = share_trees(left, right, SLOTS, &cut->left[0]) + area;
    cut->is_leaf = count <= BVH_WIDE_LEAF_MAX && !(as_node < as_leaf);
    cut->costs[0] = cut->is_leaf ? as_leaf : as_node;
    for (uint32_t k = 1; k < SLOTS - 1; k++) {
        cut->costs[k] = share_trees(left, right, k + 1, &cut->left[k]);
        if (!(cut->costs[k] < cut->costs[k - 1])) {
            cut->costs[k] = cut->costs[k - 1];
            cut->left[k] = 0;
        }
    }
}

/* ---- the chosen nodes ---- */

struct making {
    struct bvh_wide *wide;
    struct bvh_baked *baked;
    const struct bvh_binary *tree;
    const struct cut *cuts;
    uint32_t *order; /* the new order of primitives */
    uint32_t primitive_count, kind;
};

/* Adds the roots of a subtree's forest of at most `trees` trees. */
static void add_roots(const struct making *making, uint32_t n, uint32_t trees, uint32_t *roots, uint32_t *count)
{
    const struct cut *cut = &making->cuts[n];
    while (trees > 1 && cut->left[trees - 1] == 0)
        trees--;
    if (trees == 1 || is_binary_leaf(&making->tree->nodes[n])) {
        roots[(*count)++] = n;
        return;
    }
    const uint32_t left = cut->left[trees - 1], child = making->tree->nodes[n].link;
    add_roots(making, child, left, roots, count);
    add_roots(making, child + 1, trees - left, roots, count);
}

/* A child, and how far the middle of its box is off its parent's along each axis. */
struct placed {
    uint32_t root;
    float off[3];
    float gain; /* in the best slot */
};

static float gain_in(const struct placed *child, uint32_t slot)
{
    float gain = 0;
    for (uint32_t k = 0; k < 3; k++)
        gain += slot >> k & 1 ? child->off[k] : -child->off[k];
    return gain;
}

/* Puts every child into the free slot whose octant of directions meets it first, those farthest off the middle
 * before others: the paper's section 3.3 has an auction for it, which hardly differs. Slots bit 0: x is negative.
 */
static void choose_slots(const struct making *making, uint32_t n, const uint32_t *roots, uint32_t count,
                         uint32_t slots[SLOTS])
{
    const struct bvh_binary_node *parent = &making->tree->nodes[n];
    struct placed children[SLOTS];
    for (uint32_t c = 0; c < count; c++) {
        const struct bvh_binary_node *node = &making->tree->nodes[roots[c]];
        struct placed child = {.root = roots[c]};
        for (uint32_t k = 0; k < 3; k++) {
            child.off[k] = (0.5f * node->lower[k] + 0.5f * node->upper[k]) -
                           (0.5f * parent->lower[k] + 0.5f * parent->upper[k]);
            child.gain += fabsf(child.off[k]);
        }
        uint32_t at = c;
        for (; at > 0 && children[at - 1].gain < child.gain; at--)
            children[at] = children[at - 1];
        children[at] = child;
    }
    for (uint32_t s = 0; s < SLOTS; s++)
        slots[s] = BVH_NONE;
    for (uint32_t c = 0; c < count; c++) {
        uint32_t best = BVH_NONE;
        float best_gain = 0;
        for (uint32_t s = 0; s < SLOTS; s++) {
            const float gain = gain_in(&children[c], s);
            if (slots[s] == BVH_NONE && (best == BVH_NONE || gain > best_gain)) {
                best = s;
                best_gain = gain;
            }
        }
        slots[best] = children[c].root;
    }
}

/* Gives a leaf its primitives, those of a binary subtree. */
static void take_primitives(struct making *making, uint32_t n)
{
    const struct bvh_binary_node *node = &making->tree->nodes[n];
    if (!is_binary_leaf(node)) {
        take_primitives(making, node->link);
        take_primitives(making, node->link + 1);
        return;
    }
    for (uint32_t i = 0; i < node->count_axis >> 2; i++)
        making->order[making->primitive_count++] = making->tree->order[node->link + i];
}

struct waiting {
    uint32_t binary, parent, link, depth;
    uint8_t slot;
};

/* Adds the children of element e to those that wait, the last slot first. False: the tree is too deep. */
static bool add_children(struct making *making, uint32_t e, uint32_t depth, struct waiting *waiting,
                         uint32_t *waiting_count)
{
    const uint32_t n = making->baked->node[e];
    const struct bvh_binary_node *node = &making->tree->nodes[n];
    uint32_t roots[SLOTS], slots[SLOTS], count = 0, links[SLOTS];
    if (depth > BVH_WIDE_DEPTH_MAX)
        return false;
    if (is_binary_leaf(node) || making->cuts[n].is_leaf) { /* the root of a tree of one leaf */
        roots[count++] = n;
    } else {
        add_roots(making, node->link, making->cuts[n].left[0], roots, &count);
        add_roots(making, node->link + 1, SLOTS - making->cuts[n].left[0], roots, &count);
    }
    choose_slots(making, n, roots, count, slots);
    for (uint32_t s = 0; s < SLOTS; s++) {
        if (slots[s] == BVH_NONE)
            continue;
        const struct cut *cut = &making->cuts[slots[s]];
        links[s] = cut->is_leaf ? bvh_leaf(making->kind, making->primitive_count, cut->count)
                                : making->wide->node_count++;
        if (cut->is_leaf)
            take_primitives(making, slots[s]);
    }
    for (uint32_t s = SLOTS; s-- > 0;)
        if (slots[s] != BVH_NONE)
            waiting[(*waiting_count)++] = (struct waiting){slots[s], e, links[s], depth + 1, (uint8_t)s};
    return true;
}

static bool add_elements(struct making *making)
{
    struct bvh_wide *wide = making->wide;
    struct bvh_baked *baked = making->baked;
    struct waiting waiting[SLOTS * (BVH_WIDE_DEPTH_MAX + 1)];
    uint32_t waiting_count = 0;
    waiting[waiting_count++] = (struct waiting){.parent = BVH_NONE, .depth = 1};
    wide->node_count = 1;
    while (waiting_count > 0) {
        const struct waiting next = waiting[--waiting_count];
        const uint32_t e = baked->element_count++;
        baked->node[e] = next.binary;
        baked->parent[e] = next.parent;
        baked->size[e] = 1;
        wide->link[e] = next.link;
        wide->slot[e] = next.slot;
        if (next.link >> BVH_LEAF_KIND_SHIFT != 0)
            continue;
        wide->element[next.link] = e;
        if (!add_children(making, e, next.depth, waiting, &waiting_count))
            return false;
    }
    for (uint32_t e = baked->element_count; e-- > 1;)
        baked->size[baked->parent[e]] += baked->size[e];
    return true;
}

static bool alloc_all(struct bvh_wide *wide, struct bvh_baked *baked, uint32_t elements)
{
    wide->element = malloc(elements * sizeof(*wide->element));
    wide->link = malloc(elements * sizeof(*wide->link));
    wide->slot = malloc(elements * sizeof(*wide->slot));
    baked->node = malloc(elements * sizeof(*baked->node));
    baked->size = malloc(elements * sizeof(*baked->size));
    baked->parent = malloc(elements * sizeof(*baked->parent));
    return wide->element && wide->link && wide->slot && baked->node && baked->size && baked->parent;
}

enum bvh_wide_result bvh_wide_make(struct bvh_wide *wide, struct bvh_baked *baked, struct bvh_binary *tree,
                                   uint32_t kind)
{
    uint32_t *list = bvh_binary_list(tree);
    struct cut *cuts = malloc((size_t)tree->place_count * sizeof(*cuts));
    struct making making = {.wide = wide,
                            .baked = baked,
                            .tree = tree,
                            .cuts = cuts,
                            .order = malloc(tree->primitive_count * sizeof(*making.order)),
                            .kind = kind};
    *wide = (struct bvh_wide){0};
    *baked = (struct bvh_baked){0};
    enum bvh_wide_result result = BVH_WIDE_NO_MEMORY;
    /* A tree of one leaf has an element more than it has binary nodes. */
    if (list && cuts && making.order && alloc_all(wide, baked, tree->node_count + 1)) {
        for (uint32_t i = tree->node_count; i-- > 0;)
            find_cut(cuts, tree, list[i]);
        progress_report();
        result = add_elements(&making) ? BVH_WIDE_MADE : BVH_WIDE_TOO_DEEP;
    }
    if (result == BVH_WIDE_MADE) {
        free(tree->order);
        tree->order = making.order;
    } else {
        free(making.order);
        bvh_wide_finish(wide);
        bvh_baked_finish(baked);
    }
    free(list);
    free(cuts);
    return result;
}

void bvh_wide_finish(struct bvh_wide *wide)
{
    free(wide->element);
    free(wide->link);
    free(wide->slot);
    *wide = (struct bvh_wide){0};
}

/* ---- boxes in bytes ---- */

/* Exponent of the smallest cell of which CELLS reach that far. */
static int exponent_of(double extent)
{
    int exponent;
    (void)frexp(extent / CELLS, &exponent); /* below 2^exponent */
    if (ldexp(CELLS, exponent - 1) >= extent)
        exponent--;
    return exponent < FLT_MIN_EXP - 1 ? FLT_MIN_EXP - 1 : exponent;
}

/* A byte of a word that holds four. */
static void set_byte(uint32_t *words, uint32_t slot, uint32_t byte)
{
    words[slot / 4] |= byte << slot % 4 * 8;
}

void bvh_wide_write(struct bvh_wide_node *out, uint32_t n, const struct bvh_wide *wide,
                    const struct bvh_baked *baked, const struct bvh_binary *tree)
{
    const uint32_t e = wide->element[n], end = e + baked->size[e];
    const struct bvh_binary_node *node = &tree->nodes[baked->node[e]];
    const struct bvh_bound whole = bvh_bound_of_box(node->lower, node->upper);
    struct bvh_wide_node made = {
        .origin_x = whole.lower[0], .origin_y = whole.lower[1], .origin_z = whole.lower[2]};
    uint32_t meta[2] = {0}, planes[12] = {0};
    double cells_per_unit[3];
    for (uint32_t k = 0; k < 3; k++) {
        const int exponent = exponent_of((double)whole.upper[k] - (double)whole.lower[k]);
        cells_per_unit[k] = ldexp(1, -exponent);
        made.exponents |= (uint32_t)(uint8_t)exponent << 8 * k;
    }
    uint32_t place = 0;
    bool has_child = false;
    for (uint32_t child = e + 1; child < end; child += baked->size[child]) {
        const uint32_t slot = wide->slot[child], link = wide->link[child];
        const struct bvh_binary_node *box = &tree->nodes[baked->node[child]];
        const struct bvh_bound bound = bvh_bound_of_box(box->lower, box->upper);
        for (uint32_t k = 0; k < 3; k++) {
            const double low = ((double)bound.lower[k] - (double)whole.lower[k]) * cells_per_unit[k];
            const double high = ((double)bound.upper[k] - (double)whole.lower[k]) * cells_per_unit[k];
            set_byte(&planes[2 * k], slot, (uint32_t)fmin(fmax(floor(low), 0), CELLS));
            set_byte(&planes[6 + 2 * k], slot, (uint32_t)fmin(fmax(ceil(high), 0), CELLS));
        }
        if (link >> BVH_LEAF_KIND_SHIFT == 0) {
            made.exponents |= 1u << (24 + slot);
            made.first_child = has_child ? made.first_child : link;
            has_child = true;
            set_byte(meta, slot, BVH_WIDE_INNER | (24 + slot));
            continue;
        }
        const uint32_t count = (link >> BVH_LEAF_COUNT_SHIFT & BVH_LEAF_COUNT_MASK) + 1;
        made.first_primitive = place > 0 ? made.first_primitive : link & BVH_LEAF_FIRST_MASK;
        set_byte(meta, slot, ((1u << count) - 1) << 5 | place);
        place += count;
    }
    made.meta_0123 = meta[0];
    made.meta_4567 = meta[1];
    memcpy(made.planes, planes, sizeof(planes));
    *out = made;
}
