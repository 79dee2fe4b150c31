// SPDX-License-Identifier: MIT
// Builds a binary tree by the surface area heuristic, on several threads.
#include "trace/tree/build.h"

#include "base/parallel.h"
#include "base/progress.h"
#include "trace/tree/build_split.h"

#include <assert.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* Functions that are inlined twice: into one thread's work, where most ranges are small, and into that of all
 * threads. */
#define INLINED static inline __attribute__((always_inline))

#define TASK_PRIMITIVES 4096u /* smaller ranges stay with their thread */
#define STACK_DEPTH 40        /* the smaller half comes first: at most one level for each doubling of the range */
/* Nodes that a thread reserves at a time; an even number, as children come in pairs. */
#define BLOCK_NODES 512u
#define FIRST_CHILD 2u /* even, so that a pair shares a cache line */

/* Maximum of ranges that all threads cut together. */
#define CUTS_MAX(threads) (2 * (threads))

/* Primitives begin .. end - 1, which lie in the first or the second array of boxes and numbers. */
struct range {
    uint32_t node, begin, end;
    unsigned array;
};

struct builder {
    struct bvh_binary *tree;
    /* The halves of a range go to the other array than its own, and overwrite what is no longer needed. */
    struct bvh_box *boxes[2];
    uint32_t *order[2]; /* the first is the tree's */
    const struct bvh_costs *costs;
    atomic_uint next_block, node_count;
    /* Ranges that wait for a thread. */
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    struct range *waiting; /* capacity for all ranges of at least TASK_PRIMITIVES, and for those of the first
                              cuts */
    uint32_t waiting_count;
    unsigned busy;
    unsigned threads;
    const atomic_bool *stop;
};

/* The place where a thread puts nodes. */
struct place {
    uint32_t next, end, made;
};

/* Half the surface of a box, as the costs of splits are. */
static inline float half_area(const struct bvh_box *box)
{
    bvh_vec4 d = box->upper - box->lower;
    return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

/* Moves a part of a range to its halves, which grow from `left` upward and from the end, `right`, downward.
 * Returns the end of the left one. The side of a primitive is unpredictable, so nothing branches on it. */
INLINED uint32_t move(const struct builder *builder, unsigned array, uint32_t begin, uint32_t end, uint32_t left,
                      uint32_t right, const struct bvh_split *split)
{
    const struct bvh_box *boxes = builder->boxes[array];
    const uint32_t *order = builder->order[array];
    struct bvh_box *boxes_out = builder->boxes[!array];
    uint32_t *order_out = builder->order[!array];
    for (uint32_t i = begin; i < end; i++) {
        const uint32_t goes_left = bvh_split_goes_left(split, &boxes[i]);
        const uint32_t to = right ^ ((right ^ left) & (0 - goes_left));
        boxes_out[to] = boxes[i];
        order_out[to] = order[i];
        left += goes_left;
        right -= 1 - goes_left;
    }
    return left;
}

/* Bounds of boxes, and of their centres. */
struct extents {
    struct bvh_box all, centres;
};

INLINED struct extents find_extents(const struct bvh_box *boxes, uint32_t count)
{
    struct bvh_box all = bvh_box_empty(), middle = bvh_box_empty();
    for (uint32_t i = 0; i < count; i++) {
        bvh_vec4 centre = bvh_box_centre(&boxes[i]);
        all.lower = bvh_vec_min(all.lower, boxes[i].lower);
        all.upper = bvh_vec_max(all.upper, boxes[i].upper);
        middle.lower = bvh_vec_min(middle.lower, centre);
        middle.upper = bvh_vec_max(middle.upper, centre);
    }
    return (struct extents){all, middle};
}

/* ---- ranges cut by several threads, piece by piece ---- */

/* A range being cut by all threads: its pieces, and where their halves go. */
struct cut {
    const struct builder *builder;
    const struct range *range;
    struct bvh_split split;
    struct extents *extents;
    struct bvh_bins *bins;
    uint32_t *lefts; /* number of primitives of each piece that go left; then where they begin */
};

static void free_cut(struct cut *cut)
{
    free(cut->extents);
    free(cut->bins);
    free(cut->lefts);
    *cut = (struct cut){0};
}

static bool alloc_cut(struct cut *cut, uint32_t count)
{
    const uint32_t pieces = bvh_piece_count(count);
    cut->extents = aligned_alloc(_Alignof(struct extents), pieces * sizeof(*cut->extents));
    cut->bins = bvh_bins_alloc(pieces);
    cut->lefts = malloc(pieces * sizeof(*cut->lefts));
    if (cut->extents && cut->bins && cut->lefts)
        return true;
    free_cut(cut);
    return false;
}

static uint32_t size_of(const struct range *range)
{
    return range->end - range->begin;
}

static void piece_extents(void *context, uint32_t piece)
{
    const struct cut *cut = context;
    const uint32_t begin = piece * BVH_PIECE, end = bvh_piece_end(piece, size_of(cut->range));
    cut->extents[piece] =
        find_extents(cut->builder->boxes[cut->range->array] + cut->range->begin + begin, end - begin);
}

static struct extents extents_together(const struct cut *cut)
{
    const uint32_t pieces = bvh_piece_count(size_of(cut->range));
    parallel_run(cut->builder->threads, pieces, piece_extents, (void *)(uintptr_t)cut);
    struct extents sum = cut->extents[0];
    for (uint32_t piece = 1; piece < pieces; piece++) {
        bvh_box_add(&sum.all, &cut->extents[piece].all);
        bvh_box_add(&sum.centres, &cut->extents[piece].centres);
    }
    return sum;
}

static void move_piece(void *context, uint32_t piece)
{
    const struct cut *cut = context;
    const uint32_t begin = piece * BVH_PIECE, left = cut->lefts[piece];
    move(cut->builder, cut->range->array, cut->range->begin + begin,
         cut->range->begin + bvh_piece_end(piece, size_of(cut->range)), cut->range->begin + left,
         cut->range->end - 1 - (begin - left), &cut->split);
}

/* Does move() of the whole range with all threads. */
static uint32_t move_together(struct cut *cut)
{
    const uint32_t pieces = bvh_piece_count(size_of(cut->range));
    uint32_t left = 0;
    for (uint32_t piece = 0; piece < pieces; piece++) {
        const uint32_t count = cut->lefts[piece];
        cut->lefts[piece] = left;
        left += count;
    }
    parallel_run(cut->builder->threads, pieces, move_piece, cut);
    return cut->range->begin + left;
}

/* ---- ranges ---- */

static void node_set(struct bvh_binary_node *node, const struct bvh_box *box, uint32_t link, uint32_t count,
                     uint32_t axis)
{
    for (int i = 0; i < 3; i++) {
        node->lower[i] = box->lower[i];
        node->upper[i] = box->upper[i];
    }
    node->link = link;
    node->count_axis = count << 2 | axis;
}

static void make_leaf(const struct builder *builder, const struct range *range, const struct bvh_box *bounds)
{
    const uint32_t count = size_of(range);
    if (range->array != 0)
        memcpy(builder->order[0] + range->begin, builder->order[1] + range->begin,
               count * sizeof(*builder->order[0]));
    node_set(&builder->tree->nodes[range->node], bounds, range->begin, count, 0);
}

/* Reserves nodes for two children. Which thread has which block differs from run to run, but no result depends
 * on it. */
static uint32_t take_nodes(struct builder *builder, struct place *place)
{
    if (place->next == place->end) {
        place->next = FIRST_CHILD + atomic_fetch_add(&builder->next_block, 1) * BLOCK_NODES;
        place->end = place->next + BLOCK_NODES;
    }
    place->next += 2;
    place->made += 2;
    return place->next - 2;
}

/* Makes the node of a range. False: it is a leaf; otherwise *left and *right are its children's ranges. With
 * `cut` all threads work on it; NULL: this one alone. */
INLINED bool split_range(struct builder *builder, struct place *place, struct cut *cut, const struct range *range,
                         struct range *left, struct range *right)
{
    const struct bvh_box *boxes = builder->boxes[range->array] + range->begin;
    const struct bvh_costs *costs = builder->costs;
    uint32_t count = size_of(range), middle = range->begin + count / 2, axis = 0;
    const struct extents extents = cut ? extents_together(cut) : find_extents(boxes, count);
    float area = builder->tree->areas[range->node] = half_area(&extents.all);
    struct bvh_split split = {.axis = -1};
    if (cut && !costs->halves)
        split = bvh_split_find_together(boxes, count, &extents.centres, builder->threads, cut->bins, cut->lefts);
    else if (count > (costs->primitive > 0 ? 1 : costs->leaf_max) && !costs->halves)
        split = bvh_split_find(boxes, count, &extents.centres);
    bool pays = split.axis >= 0 &&
                2 * costs->element * area + costs->primitive * split.cost < costs->primitive * (float)count * area;
    if (count <= costs->leaf_max && !pays) {
        make_leaf(builder, range, &extents.all);
        return false;
    }
    /* Halves the range where no border separates the primitives (equal centres, or extents that overflow). */
    unsigned array = range->array;
    if (split.axis >= 0) {
        uint32_t border;
        if (cut) {
            cut->split = split;
            border = move_together(cut);
        } else {
            border = move(builder, range->array, range->begin, range->end, range->begin, range->end - 1, &split);
        }
        if (border > range->begin && border < range->end)
            middle = border;
        axis = (uint32_t)split.axis;
        array = !array;
    }
    const uint32_t children = take_nodes(builder, place);
    node_set(&builder->tree->nodes[range->node], &extents.all, children, 0, axis);
    *left = (struct range){children, range->begin, middle, array};
    *right = (struct range){children + 1, middle, range->end, array};
    return true;
}

static void give_away(struct builder *builder, const struct range *range)
{
    pthread_mutex_lock(&builder->mutex);
    builder->waiting[builder->waiting_count++] = *range;
    pthread_cond_signal(&builder->changed);
    pthread_mutex_unlock(&builder->mutex);
}

static void build_range(struct builder *builder, struct place *place, struct range range)
{
    struct range stack[STACK_DEPTH];
    unsigned depth = 0;
    while (!bvh_is_stopped(builder->stop)) {
        struct range left, right;
        if (size_of(&range) >= TASK_PRIMITIVES)
            progress_report();
        if (split_range(builder, place, NULL, &range, &left, &right)) {
            bool left_is_larger = size_of(&left) > size_of(&right);
            struct range *larger = left_is_larger ? &left : &right;
            range = left_is_larger ? right : left;
            if (builder->threads > 1 && size_of(larger) >= TASK_PRIMITIVES)
                give_away(builder, larger);
            else
                stack[depth++] = *larger;
        } else if (depth > 0) {
            range = stack[--depth];
        } else {
            return;
        }
    }
}

/* Thread of the builder: processes ranges until none is left and no thread can add one. */
static void build_thread(void *context, uint32_t thread)
{
    (void)thread;
    struct builder *builder = context;
    struct place place = {0};
    pthread_mutex_lock(&builder->mutex);
    for (;;) {
        if (builder->waiting_count > 0) {
            struct range range = builder->waiting[--builder->waiting_count];
            builder->busy++;
            pthread_mutex_unlock(&builder->mutex);
            build_range(builder, &place, range);
            pthread_mutex_lock(&builder->mutex);
            builder->busy--;
        } else if (builder->busy > 0) {
            pthread_cond_wait(&builder->changed, &builder->mutex);
        } else {
            break;
        }
    }
    pthread_cond_broadcast(&builder->changed);
    pthread_mutex_unlock(&builder->mutex);
    atomic_fetch_add(&builder->node_count, place.made);
}

/* Cuts the first ranges with all threads, until there is a range for each thread. */
static void cut_together(struct builder *builder)
{
    const uint32_t large = builder->tree->primitive_count / builder->threads;
    struct cut cut = {.builder = builder};
    struct place place = {0};
    if (builder->threads == 1 || !alloc_cut(&cut, builder->tree->primitive_count))
        return;
    uint32_t cuts_left = CUTS_MAX(builder->threads);
    for (uint32_t i = 0; i < builder->waiting_count && cuts_left > 0 && !bvh_is_stopped(builder->stop);) {
        const struct range range = builder->waiting[i];
        struct range left, right;
        if (size_of(&range) <= large || size_of(&range) < TASK_PRIMITIVES) {
            i++;
            continue;
        }
        cut.range = &range;
        cuts_left--;
        if (split_range(builder, &place, &cut, &range, &left, &right)) {
            builder->waiting[i] = left;
            builder->waiting[builder->waiting_count++] = right;
        } else {
            builder->waiting[i] = builder->waiting[--builder->waiting_count];
        }
    }
    free_cut(&cut);
    atomic_fetch_add(&builder->node_count, place.made);
}

static void free_work(struct builder *builder)
{
    free(builder->order[1]);
    free(builder->waiting);
}

/* Allocates the maximum for nodes; the kernel provides only the pages that are written. */
static bool alloc_work(struct builder *builder, uint32_t count, unsigned threads)
{
    struct bvh_binary *tree = builder->tree;
    const size_t places = FIRST_CHILD + 2 * (size_t)count + ((size_t)threads + 1) * BLOCK_NODES;
    tree->nodes = aligned_alloc(32, places * sizeof(*tree->nodes));
    tree->areas = malloc(places * sizeof(*tree->areas));
    tree->order = builder->order[0] = malloc(count * sizeof(*tree->order));
    builder->order[1] = malloc(count * sizeof(*tree->order));
    builder->waiting = malloc((count / TASK_PRIMITIVES + 1 + CUTS_MAX(threads)) * sizeof(*builder->waiting));
    return tree->nodes && tree->areas && tree->order && builder->order[1] && builder->waiting;
}

bool bvh_binary_build(struct bvh_binary *tree, struct bvh_box *boxes, uint32_t count,
                      const struct bvh_costs *costs, unsigned threads, const atomic_bool *stop)
{
    *tree = (struct bvh_binary){.primitive_count = count};
    struct builder builder = {.tree = tree,
                              .boxes = {boxes, boxes + count},
                              .costs = costs,
                              .node_count = 1,
                              .threads = threads,
                              .stop = stop};
    const bool has_memory = alloc_work(&builder, count, threads);
    for (uint32_t i = 0; has_memory && i < count; i++)
        tree->order[i] = i;
    pthread_mutex_init(&builder.mutex, NULL);
    pthread_cond_init(&builder.changed, NULL);
    if (has_memory) {
        builder.waiting[builder.waiting_count++] = (struct range){.end = count};
        cut_together(&builder);
        parallel_run(threads, threads, build_thread, &builder);
    }
    pthread_cond_destroy(&builder.changed);
    pthread_mutex_destroy(&builder.mutex);
    free_work(&builder);
    tree->node_count = builder.node_count;
    tree->place_count = FIRST_CHILD + builder.next_block * BLOCK_NODES;
    if (has_memory && !bvh_is_stopped(stop))
        return true;
    bvh_binary_finish(tree);
    return false;
}

void bvh_binary_finish(struct bvh_binary *tree)
{
    free(tree->nodes);
    free(tree->areas);
    free(tree->order);
    *tree = (struct bvh_binary){0};
}

uint32_t *bvh_binary_list(const struct bvh_binary *tree)
{
    const struct bvh_binary_node *nodes = tree->nodes;
    uint32_t *list = malloc((size_t)tree->node_count * sizeof(*list)), count = 0, waiting = tree->node_count,
             i = 0;
    if (!list)
        return NULL;
    /* Right children wait at the end of the list, whose tail is still free. */
    for (;;) {
        list[count++] = i;
        if (nodes[i].count_axis >> 2 == 0) {
            list[--waiting] = nodes[i].link + 1;
            i = nodes[i].link;
        } else if (waiting < tree->node_count) {
            i = list[waiting++];
        } else {
            return list;
        }
    }
}
