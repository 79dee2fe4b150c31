// SPDX-License-Identifier: MIT
#include "trace/tree/build.h"

#include "base/parallel.h"
#include "base/progress.h"
#include "trace/tree/build_split.h"

#include <assert.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define TASK_PRIMITIVES 4096u /* smaller ranges stay with the thread that has them */
#define STACK_DEPTH 40        /* the smaller half comes first: at most one level for each doubling of the range */
#define BLOCK_NODES 512u      /* that a thread takes at a time; an even number, as children come in pairs */
#define FIRST_CHILD 2u        /* so that a pair lies in one line of the cache */

/* Primitives begin .. end - 1, which lie in the first or the second array of boxes and numbers. */
struct range {
    uint32_t node, begin, end;
    unsigned array;
};

struct builder {
    struct bvh_binary *tree;
    /* A range's halves go to the other array than its own: what is not needed any more is written over. */
    struct bvh_box *boxes[2];
    uint32_t *order[2]; /* the first is the tree's */
    const struct bvh_costs *costs;
    atomic_uint next_block, node_count;
    /* ranges that wait for a thread */
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    struct range *waiting; /* capacity for all ranges of at least TASK_PRIMITIVES */
    uint32_t waiting_count;
    unsigned busy;
    bool shared; /* several threads */
    const atomic_bool *stop;
};

/* Where a thread puts nodes. */
struct place {
    uint32_t next, end, made;
};

/* Half the surface, as the costs of splits are. */
static inline float half_area(const struct bvh_box *box)
{
    bvh_vec4 d = box->upper - box->lower;
    return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

/* Returns the first primitive of the right half. The side of a primitive is unpredictable, so nothing branches on
 * it. The right half is filled from its end. */
static uint32_t partition(const struct builder *builder, const struct range *range, const struct bvh_split *split)
{
    const struct bvh_box *boxes = builder->boxes[range->array];
    const uint32_t *order = builder->order[range->array];
    struct bvh_box *boxes_out = builder->boxes[!range->array];
    uint32_t *order_out = builder->order[!range->array];
    uint32_t left = range->begin, right = range->end - 1;
    for (uint32_t i = range->begin; i < range->end; i++) {
        const uint32_t goes_left = bvh_split_goes_left(split, &boxes[i]);
        const uint32_t to = right ^ ((right ^ left) & (0 - goes_left));
        boxes_out[to] = boxes[i];
        order_out[to] = order[i];
        left += goes_left;
        right -= 1 - goes_left;
    }
    return left;
}

static void find_bounds(const struct bvh_box *boxes, uint32_t count, struct bvh_box *bounds,
                        struct bvh_box *centres)
{
    struct bvh_box all = bvh_box_empty(), middle = bvh_box_empty();
    for (uint32_t i = 0; i < count; i++) {
        bvh_vec4 centre = bvh_box_centre(&boxes[i]);
        all.lower = bvh_vec_min(all.lower, boxes[i].lower);
        all.upper = bvh_vec_max(all.upper, boxes[i].upper);
        middle.lower = bvh_vec_min(middle.lower, centre);
        middle.upper = bvh_vec_max(middle.upper, centre);
    }
    *bounds = all;
    *centres = middle;
}

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
    const uint32_t count = range->end - range->begin;
    if (range->array != 0)
        memcpy(builder->order[0] + range->begin, builder->order[1] + range->begin,
               count * sizeof(*builder->order[0]));
    node_set(&builder->tree->nodes[range->node], bounds, range->begin, count, 0);
}

/* Of two children. Which thread has which block differs from run to run, but nothing follows from it. */
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

/* Makes the node of a range. False: it is a leaf; else the ranges of its children. */
static bool split_range(struct builder *builder, struct place *place, const struct range *range,
                        struct range *left, struct range *right)
{
    const struct bvh_box *boxes = builder->boxes[range->array] + range->begin;
    struct bvh_box bounds, centres;
    find_bounds(boxes, range->end - range->begin, &bounds, &centres);
    float area = builder->tree->areas[range->node] = half_area(&bounds);
    const struct bvh_costs *costs = builder->costs;
    uint32_t count = range->end - range->begin, middle = range->begin + count / 2, axis = 0;
    struct bvh_split split = {.axis = -1};
    if (count > 1)
        split = bvh_split_find(boxes, count, &centres);
    bool pays = split.axis >= 0 &&
                2 * costs->element * area + costs->primitive * split.cost < costs->primitive * (float)count * area;
    if (count <= costs->leaf_max && !pays) {
        make_leaf(builder, range, &bounds);
        return false;
    }
    /* Where no border separates them (equal centres, or extents that overflow), half of them goes each way. */
    unsigned array = range->array;
    if (split.axis >= 0) {
        uint32_t border = partition(builder, range, &split);
        if (border > range->begin && border < range->end)
            middle = border;
        axis = (uint32_t)split.axis;
        array = !array;
    }
    const uint32_t children = take_nodes(builder, place);
    node_set(&builder->tree->nodes[range->node], &bounds, children, 0, axis);
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
        if (range.end - range.begin >= TASK_PRIMITIVES)
            progress_tell();
        if (split_range(builder, place, &range, &left, &right)) {
            bool left_is_larger = left.end - left.begin > right.end - right.begin;
            struct range *larger = left_is_larger ? &left : &right;
            range = left_is_larger ? right : left;
            if (builder->shared && larger->end - larger->begin >= TASK_PRIMITIVES)
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

/* One thread of the builder: processes ranges until none is left and no thread can add one. */
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

static void free_work(struct builder *builder)
{
    free(builder->order[1]);
    free(builder->waiting);
}

/* The nodes' memory is as much as there may be at most, of which the kernel gives what is written. */
static bool alloc_work(struct builder *builder, uint32_t count, unsigned threads)
{
    struct bvh_binary *tree = builder->tree;
    const size_t places = FIRST_CHILD + 2 * (size_t)count + (size_t)threads * BLOCK_NODES;
    tree->nodes = aligned_alloc(32, places * sizeof(*tree->nodes));
    tree->areas = malloc(places * sizeof(*tree->areas));
    tree->order = builder->order[0] = malloc(count * sizeof(*tree->order));
    builder->order[1] = malloc(count * sizeof(*tree->order));
    builder->waiting = malloc((count / TASK_PRIMITIVES + 1) * sizeof(*builder->waiting));
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
                              .shared = threads > 1,
                              .stop = stop};
    const bool has_memory = alloc_work(&builder, count, threads);
    for (uint32_t i = 0; has_memory && i < count; i++)
        tree->order[i] = i;
    pthread_mutex_init(&builder.mutex, NULL);
    pthread_cond_init(&builder.changed, NULL);
    if (has_memory) {
        builder.waiting[builder.waiting_count++] = (struct range){.end = count};
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
    /* Right children wait at the list's end: each is a node that the list does not have yet. */
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
