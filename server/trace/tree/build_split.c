// SPDX-License-Identifier: MIT
#include "trace/tree/build_split.h"

#include <string.h>

#define BINS_MAX 16
#define SMALL_RANGE 24 /* ranges below are split with fewer bins: the sweep would cost more than the filling */
#define BINS_SMALL 8

typedef int32_t int4 __attribute__((vector_size(16)));

struct bins {
    struct bvh_box boxes[BINS_MAX][3]; /* of each axis */
    _Alignas(16) int32_t counts[BINS_MAX][4];
    int count;
};

/* The best cut of each axis; lane 3 is unused. */
struct best {
    bvh_vec4 cost;
    int4 bin; /* primitives of this bin and those after go right; 0: none found */
};

static bvh_vec4 choose(int4 which, bvh_vec4 yes, bvh_vec4 no)
{
    return (bvh_vec4)(((int4)yes & which) | ((int4)no & ~which));
}

static inline int4 counts_of(const struct bins *bins, int bin)
{
    int4 counts;
    memcpy(&counts, bins->counts[bin], sizeof(counts));
    return counts;
}

static inline void add_to_bin(struct bins *bins, int bin, int axis, const struct bvh_box *box)
{
    bvh_box_add(&bins->boxes[bin][axis], box);
    bins->counts[bin][axis]++;
}

static void fill_bins(struct bins *bins, const struct bvh_box *boxes, uint32_t count, bvh_vec4 origin,
                      bvh_vec4 scale)
{
    for (int i = 0; i < bins->count; i++) {
        bins->boxes[i][0] = bins->boxes[i][1] = bins->boxes[i][2] = bvh_box_empty();
        memset(bins->counts[i], 0, sizeof(bins->counts[i]));
    }
    const float last = (float)(bins->count - 1);
    const bvh_vec4 zero = {0, 0, 0, 0}, last_bin = {last, last, last, last};
    for (uint32_t i = 0; i < count; i++) {
        bvh_vec4 place = (bvh_box_centre(&boxes[i]) - origin) * scale;
        /* in this order: what is not a number becomes 0 */
        int4 bin = __builtin_convertvector(bvh_vec_min(bvh_vec_max(place, zero), last_bin), int4);
        add_to_bin(bins, bin[0], 0, &boxes[i]);
        add_to_bin(bins, bin[1], 1, &boxes[i]);
        add_to_bin(bins, bin[2], 2, &boxes[i]);
    }
}

/* Half the surfaces of three boxes: a constant factor changes no choice. */
static inline bvh_vec4 box_areas(const struct bvh_box boxes[3])
{
    bvh_vec4 a = boxes[0].upper - boxes[0].lower, b = boxes[1].upper - boxes[1].lower;
    bvh_vec4 c = boxes[2].upper - boxes[2].lower;
    bvh_vec4 xy = __builtin_shufflevector(a, b, 0, 4, 1, 5), zw = __builtin_shufflevector(a, b, 2, 6, 3, 7);
    bvh_vec4 x = __builtin_shufflevector(xy, c, 0, 1, 4, 4), y = __builtin_shufflevector(xy, c, 2, 3, 5, 5);
    bvh_vec4 z = __builtin_shufflevector(zw, c, 0, 1, 6, 6);
    return x * y + y * z + z * x;
}

static inline void add_boxes(struct bvh_box sum[3], const struct bvh_box boxes[3])
{
    bvh_box_add(&sum[0], &boxes[0]);
    bvh_box_add(&sum[1], &boxes[1]);
    bvh_box_add(&sum[2], &boxes[2]);
}

static struct best sweep(const struct bins *bins)
{
    bvh_vec4 area_right[BINS_MAX];
    struct bvh_box sum[3] = {bvh_box_empty(), bvh_box_empty(), bvh_box_empty()};
    int4 total = counts_of(bins, 0), left = {0, 0, 0, 0};
    for (int i = bins->count - 1; i > 0; i--) {
        add_boxes(sum, bins->boxes[i]);
        total += counts_of(bins, i);
        area_right[i] = box_areas(sum);
    }
    sum[0] = sum[1] = sum[2] = bvh_box_empty();
    struct best best = {{FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX}, {0, 0, 0, 0}};
    for (int i = 1; i < bins->count; i++) {
        add_boxes(sum, bins->boxes[i - 1]);
        left += counts_of(bins, i - 1);
        bvh_vec4 cost = box_areas(sum) * __builtin_convertvector(left, bvh_vec4) +
                        area_right[i] * __builtin_convertvector(total - left, bvh_vec4);
        /* Where a side is empty its area means nothing. */
        int4 better = (cost < best.cost) & (left > 0) & (left < total);
        best.cost = choose(better, cost, best.cost);
        best.bin = (better & i) | (~better & best.bin);
    }
    return best;
}

struct bvh_split bvh_split_find(const struct bvh_box *boxes, uint32_t count, const struct bvh_box *centres)
{
    struct bins bins; /* filled as far as it is used */
    bins.count = count < SMALL_RANGE ? BINS_SMALL : BINS_MAX;
    bvh_vec4 extent = centres->upper - centres->lower, scale = {0, 0, 0, 0};
    for (int axis = 0; axis < 3; axis++)
        scale[axis] = extent[axis] > 0 ? (float)bins.count / extent[axis] : 0;
    fill_bins(&bins, boxes, count, centres->lower, scale);
    const struct best best = sweep(&bins);
    struct bvh_split split = {.axis = -1, .cost = FLT_MAX};
    for (int axis = 0; axis < 3; axis++)
        if (extent[axis] > 0 && best.bin[axis] > 0 && best.cost[axis] < split.cost)
            split = (struct bvh_split){axis, best.cost[axis], centres->lower[axis], scale[axis],
                                       (float)best.bin[axis]};
    return split;
}
