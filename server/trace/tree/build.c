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

struct range {
    uint32_t node, begin, end;
};

struct builder {
    struct bvh_binary *tree;
    struct bvh_box *boxes;
    uint32_t *order_right; /* where each range puts its right half while its left half is gathered */
    const struct bvh_costs *costs;
    /* ranges that wait for a thread */
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    struct range *waiting; /* capacity for all ranges of at least TASK_PRIMITIVES */
    uint32_t waiting_count;
    unsigned busy;
    bool shared; /* several threads */
    const atomic_bool *stop;
};

/* Half the surface, as the costs of splits are. */
static inline float half_area(const struct bvh_box *box)
{
    bvh_vec4 d = box->upper - box->lower;
    return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

/* The memory of its nodes is unused until a range is split: it holds its boxes, which have the same size. */
static struct bvh_box *spare_boxes(const struct builder *builder, const struct range *range)
{
    static_assert(sizeof(struct bvh_box) == sizeof(struct bvh_binary_node), "a box fits where a node goes");
    return (struct bvh_box *)(void *)(builder->tree->nodes + range->node);
}

/* Returns the first primitive of the right half. The side of a primitive is unpredictable, so nothing branches on
 * it: each is written to both places, and only one of them advances. */
static uint32_t partition(const struct builder *builder, const struct range *range, const struct bvh_split *split)
{
    struct bvh_box *boxes = builder->boxes, *boxes_right = spare_boxes(builder, range);
    uint32_t *order = builder->tree->order, *order_right = builder->order_right + range->begin;
    uint32_t left = range->begin, right = 0;
    for (uint32_t i = range->begin; i < range->end; i++) {
        const struct bvh_box box = boxes[i];
        const uint32_t number = order[i];
        bool goes_left = bvh_split_goes_left(split, &box);
        boxes[left] = boxes_right[right] = box;
        order[left] = order_right[right] = number;
        left += goes_left;
        right += !goes_left;
    }
    memcpy(boxes + left, boxes_right, right * sizeof(*boxes));
    memcpy(order + left, order_right, right * sizeof(*order));
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

/* Makes the node of a range. False: it is a leaf; else the ranges of its children. */
static bool split_range(const struct builder *builder, const struct range *range, struct range *left,
                        struct range *right)
{
    struct bvh_box bounds, centres;
    find_bounds(builder->boxes + range->begin, range->end - range->begin, &bounds, &centres);
    struct bvh_binary_node *node = &builder->tree->nodes[range->node];
    float area = builder->tree->areas[range->node] = half_area(&bounds);
    const struct bvh_costs *costs = builder->costs;
    uint32_t count = range->end - range->begin, middle = range->begin + count / 2, axis = 0;
    struct bvh_split split = {.axis = -1};
    if (count > 1)
        split = bvh_split_find(builder->boxes + range->begin, count, &centres);
    bool pays = split.axis >= 0 &&
                2 * costs->element * area + costs->primitive * split.cost < costs->primitive * (float)count * area;
    if (count <= costs->leaf_max && !pays) {
        node_set(node, &bounds, range->begin, count, 0);
        return false;
    }
    /* Where no border separates them (equal centres, or extents that overflow), half of them goes each way. */
    if (split.axis >= 0) {
        uint32_t border = partition(builder, range, &split);
        if (border > range->begin && border < range->end)
            middle = border;
        axis = (uint32_t)split.axis;
    }
    uint32_t right_node = range->node + 2 * (middle - range->begin);
    node_set(node, &bounds, right_node, 0, axis);
    *left = (struct range){range->node + 1, range->begin, middle};
    *right = (struct range){right_node, middle, range->end};
    return true;
}

static void give_away(struct builder *builder, const struct range *range)
{
    pthread_mutex_lock(&builder->mutex);
    builder->waiting[builder->waiting_count++] = *range;
    pthread_cond_signal(&builder->changed);
    pthread_mutex_unlock(&builder->mutex);
}

static void build_range(struct builder *builder, struct range range)
{
    struct range stack[STACK_DEPTH];
    unsigned depth = 0;
    while (!bvh_is_stopped(builder->stop)) {
        struct range left, right;
        if (range.end - range.begin >= TASK_PRIMITIVES)
            progress_tell();
        if (split_range(builder, &range, &left, &right)) {
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
    pthread_mutex_lock(&builder->mutex);
    for (;;) {
        if (builder->waiting_count > 0) {
            struct range range = builder->waiting[--builder->waiting_count];
            builder->busy++;
            pthread_mutex_unlock(&builder->mutex);
            build_range(builder, range);
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
}

static void free_work(struct builder *builder)
{
    free(builder->order_right);
    free(builder->waiting);
}

bool bvh_binary_build(struct bvh_binary *tree, struct bvh_box *boxes, uint32_t count,
                      const struct bvh_costs *costs, unsigned threads, const atomic_bool *stop)
{
    *tree = (struct bvh_binary){.primitive_count = count};
    struct builder builder = {.tree = tree, .boxes = boxes, .costs = costs, .shared = threads > 1, .stop = stop};
    tree->nodes = aligned_alloc(16, (2 * (size_t)count - 1) * sizeof(*tree->nodes));
    tree->areas = malloc((2 * (size_t)count - 1) * sizeof(*tree->areas));
    tree->order = malloc(count * sizeof(*tree->order));
    builder.waiting = malloc((count / TASK_PRIMITIVES + 1) * sizeof(*builder.waiting));
    builder.order_right = malloc(count * sizeof(*builder.order_right));
    if (!tree->nodes || !tree->areas || !tree->order || !builder.waiting || !builder.order_right) {
        free_work(&builder);
        bvh_binary_finish(tree);
        return false;
    }
    for (uint32_t i = 0; i < count; i++)
        tree->order[i] = i;
    pthread_mutex_init(&builder.mutex, NULL);
    pthread_cond_init(&builder.changed, NULL);
    builder.waiting[builder.waiting_count++] = (struct range){0, 0, count};
    parallel_run(threads, threads, build_thread, &builder);
    pthread_cond_destroy(&builder.changed);
    pthread_mutex_destroy(&builder.mutex);
    free_work(&builder);
    if (!bvh_is_stopped(stop))
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

uint32_t bvh_binary_next(const struct bvh_binary_node *nodes, uint32_t i)
{
    uint32_t count = nodes[i].count_axis >> 2;
    return count > 0 ? i + 2 * count - 1 : i + 1;
}
