// SPDX-License-Identifier: MIT
#include "trace/bvh_build.h"

#include <float.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#define BINS_MAX 16
#define SMALL_RANGE 24 /* ranges below are split with fewer bins: the sweep would cost more than the filling */
#define BINS_SMALL 8
#define TASK_PRIMITIVES 4096u /* smaller ranges stay with the thread that has them */
#define STACK_DEPTH 40 /* the smaller half is walked first: a level at most for each doubling of the range */

struct range {
    uint32_t node, begin, end;
};

struct builder {
    struct bvh_binary *tree;
    struct bvh_box *boxes;
    const struct bvh_costs *costs;
    /* ranges that wait for a thread */
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    struct range *waiting; /* room for every range of at least TASK_PRIMITIVES at once */
    uint32_t waiting_count;
    unsigned busy;
    bool shared; /* several threads */
};

struct bin {
    struct bvh_box box;
    uint32_t count;
};

struct split {
    int axis; /* -1: none found */
    int bin;  /* primitives of this bin and those after go right */
    int bins;
    float cost;
    bvh_vec4 origin, scale; /* bin = (centre - origin) scale */
};

#if defined(__SSE__)
static inline bvh_vec4 vec_min(bvh_vec4 a, bvh_vec4 b)
{
    return (bvh_vec4)_mm_min_ps((__m128)a, (__m128)b);
}
static inline bvh_vec4 vec_max(bvh_vec4 a, bvh_vec4 b)
{
    return (bvh_vec4)_mm_max_ps((__m128)a, (__m128)b);
}
#else
static inline bvh_vec4 vec_min(bvh_vec4 a, bvh_vec4 b)
{
    for (int i = 0; i < 4; i++)
        a[i] = a[i] < b[i] ? a[i] : b[i];
    return a;
}
static inline bvh_vec4 vec_max(bvh_vec4 a, bvh_vec4 b)
{
    for (int i = 0; i < 4; i++)
        a[i] = a[i] > b[i] ? a[i] : b[i];
    return a;
}
#endif

static inline struct bvh_box box_empty(void)
{
    return (struct bvh_box){{FLT_MAX, FLT_MAX, FLT_MAX, 0}, {-FLT_MAX, -FLT_MAX, -FLT_MAX, 0}};
}

static inline void box_add(struct bvh_box *box, const struct bvh_box *other)
{
    box->lower = vec_min(box->lower, other->lower);
    box->upper = vec_max(box->upper, other->upper);
}

/* Half the surface: a constant factor changes no choice. */
static inline float box_area(const struct bvh_box *box)
{
    bvh_vec4 d = box->upper - box->lower;
    return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

static inline bvh_vec4 box_centre(const struct bvh_box *box)
{
    return 0.5f * box->lower + 0.5f * box->upper; /* halves first: the sum of two large ones is infinite */
}

/* A NaN (infinite extent times zero) goes to bin 0. */
static inline int bin_of(float place, int bins)
{
    if (!(place > 0))
        return 0;
    return place < (float)bins ? (int)place : bins - 1;
}

static void fill_bins(const struct builder *builder, const struct range *range, const struct split *frame,
                      struct bin bins[3][BINS_MAX])
{
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < frame->bins; i++)
            bins[axis][i] = (struct bin){box_empty(), 0};
    for (uint32_t i = range->begin; i < range->end; i++) {
        const struct bvh_box *box = &builder->boxes[i];
        bvh_vec4 place = (box_centre(box) - frame->origin) * frame->scale;
        for (int axis = 0; axis < 3; axis++) {
            struct bin *bin = &bins[axis][bin_of(place[axis], frame->bins)];
            box_add(&bin->box, box);
            bin->count++;
        }
    }
}

/* The cheapest border between bins of one axis. */
static void sweep_axis(const struct bin *bins, int axis, struct split *best)
{
    float area_right[BINS_MAX];
    struct bvh_box box = box_empty();
    uint32_t total = 0, left = 0;
    for (int i = best->bins - 1; i > 0; i--) {
        box_add(&box, &bins[i].box);
        total += bins[i].count;
        area_right[i] = total ? box_area(&box) : 0;
    }
    total += bins[0].count;
    box = box_empty();
    for (int i = 1; i < best->bins; i++) {
        box_add(&box, &bins[i - 1].box);
        left += bins[i - 1].count;
        if (left == 0 || left == total)
            continue;
        float cost = box_area(&box) * (float)left + area_right[i] * (float)(total - left);
        if (cost < best->cost) {
            best->cost = cost;
            best->axis = axis;
            best->bin = i;
        }
    }
}

static struct split find_split(const struct builder *builder, const struct range *range,
                               const struct bvh_box *centres)
{
    uint32_t count = range->end - range->begin;
    struct split split = {.axis = -1, .bins = count < SMALL_RANGE ? BINS_SMALL : BINS_MAX, .cost = FLT_MAX};
    split.origin = centres->lower;
    bvh_vec4 extent = centres->upper - centres->lower;
    for (int axis = 0; axis < 3; axis++)
        split.scale[axis] = extent[axis] > 0 ? (float)split.bins / extent[axis] : 0;
    struct bin bins[3][BINS_MAX];
    fill_bins(builder, range, &split, bins);
    for (int axis = 0; axis < 3; axis++)
        if (extent[axis] > 0)
            sweep_axis(bins[axis], axis, &split);
    return split;
}

static inline void swap_primitives(const struct builder *builder, uint32_t a, uint32_t b)
{
    struct bvh_box box = builder->boxes[a];
    uint32_t number = builder->tree->order[a];
    builder->boxes[a] = builder->boxes[b];
    builder->tree->order[a] = builder->tree->order[b];
    builder->boxes[b] = box;
    builder->tree->order[b] = number;
}

/* Returns the first primitive of the right half. */
static uint32_t partition(const struct builder *builder, const struct range *range, const struct split *split)
{
    uint32_t begin = range->begin, end = range->end;
    float origin = split->origin[split->axis], scale = split->scale[split->axis];
    while (begin < end) {
        float centre = box_centre(&builder->boxes[begin])[split->axis];
        if (bin_of((centre - origin) * scale, split->bins) < split->bin)
            begin++;
        else
            swap_primitives(builder, begin, --end);
    }
    return begin;
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
    struct bvh_box bounds = box_empty(), centres = box_empty();
    for (uint32_t i = range->begin; i < range->end; i++) {
        bvh_vec4 centre = box_centre(&builder->boxes[i]);
        box_add(&bounds, &builder->boxes[i]);
        box_add(&centres, &(struct bvh_box){centre, centre});
    }
    struct bvh_binary_node *node = &builder->tree->nodes[range->node];
    const struct bvh_costs *costs = builder->costs;
    uint32_t count = range->end - range->begin, middle = range->begin + count / 2, axis = 0;
    struct split split = {.axis = -1};
    if (count > 1)
        split = find_split(builder, range, &centres);
    float area = box_area(&bounds);
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
    for (;;) {
        struct range left, right;
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

/* One thread of the builder: takes ranges until none is left and nobody can make another. */
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

bool bvh_binary_build(struct bvh_binary *tree, struct bvh_box *boxes, uint32_t count,
                      const struct bvh_costs *costs, unsigned threads)
{
    *tree = (struct bvh_binary){.primitive_count = count};
    struct builder builder = {.tree = tree, .boxes = boxes, .costs = costs, .shared = threads > 1};
    tree->nodes = malloc((2 * (size_t)count - 1) * sizeof *tree->nodes);
    tree->order = malloc(count * sizeof *tree->order);
    builder.waiting = malloc((count / TASK_PRIMITIVES + 1) * sizeof *builder.waiting);
    if (!tree->nodes || !tree->order || !builder.waiting) {
        free(builder.waiting);
        bvh_binary_finish(tree);
        return false;
    }
    for (uint32_t i = 0; i < count; i++)
        tree->order[i] = i;
    pthread_mutex_init(&builder.mutex, NULL);
    pthread_cond_init(&builder.changed, NULL);
    builder.waiting[builder.waiting_count++] = (struct range){0, 0, count};
    bvh_parallel(threads, threads, build_thread, &builder);
    pthread_cond_destroy(&builder.changed);
    pthread_mutex_destroy(&builder.mutex);
    free(builder.waiting);
    return true;
}

void bvh_binary_finish(struct bvh_binary *tree)
{
    free(tree->nodes);
    free(tree->order);
    *tree = (struct bvh_binary){0};
}

uint32_t bvh_binary_next(const struct bvh_binary_node *nodes, uint32_t i)
{
    uint32_t count = nodes[i].count_axis >> 2;
    return count > 0 ? i + 2 * count - 1 : i + 1;
}
