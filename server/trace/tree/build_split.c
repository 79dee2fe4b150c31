// SPDX-License-Identifier: MIT
// Bins of primitives, and the sweep that finds the cheapest cut.
#include "trace/tree/build_split.h"

#include "base/parallel.h"

#include <stdlib.h>
#include <string.h>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

/* Functions that are inlined twice: into bvh_split_find() for any processor, and into that for AVX2. */
#define INLINED static inline __attribute__((always_inline))

#define BINS_MAX 16
#define SMALL_RANGE 24 /* smaller ranges are split with fewer bins: the sweep would cost more than the filling */
#define BINS_SMALL 8
#define LARGE_RANGE 256

typedef int32_t int4 __attribute__((vector_size(16)));

/* A box as its lower corner and its negated upper corner, so that minima alone unite boxes. */
typedef float corners __attribute__((vector_size(32)));

struct bvh_bins {
    corners boxes[BINS_MAX][3]; /* boxes of each axis */
    _Alignas(16) int32_t counts[BINS_MAX][4];
    int count;
};

/* The best cut of each axis; lane 3 is unused. */
struct best {
    bvh_vec4 cost;
    int4 bin; /* primitives of this bin and those after it go right; 0: none found */
};

static bvh_vec4 choose(int4 which, bvh_vec4 yes, bvh_vec4 no)
{
    return (bvh_vec4)(((int4)yes & which) | ((int4)no & ~which));
}

static inline int4 counts_of(const struct bvh_bins *bins, int bin)
{
    int4 counts;
    memcpy(&counts, bins->counts[bin], sizeof(counts));
    return counts;
}

typedef void minimum(corners *a, const corners *b); /* stores the minimum in the first */

static inline void minimum_of_halves(corners *a, const corners *b)
{
    bvh_vec4 *halves = (bvh_vec4 *)a;
    const bvh_vec4 *others = (const bvh_vec4 *)b;
    halves[0] = bvh_vec_min(halves[0], others[0]);
    halves[1] = bvh_vec_min(halves[1], others[1]);
}

static const corners nothing = {FLT_MAX, FLT_MAX, FLT_MAX, 0, FLT_MAX, FLT_MAX, FLT_MAX, 0};

INLINED void corners_of(corners *out, const struct bvh_box *box)
{
    *out = __builtin_shufflevector(box->lower, -box->upper, 0, 1, 2, 3, 4, 5, 6, 7);
}

INLINED void clear_bins(struct bvh_bins *bins)
{
    for (int i = 0; i < bins->count; i++) {
        bins->boxes[i][0] = bins->boxes[i][1] = bins->boxes[i][2] = nothing;
        memset(bins->counts[i], 0, sizeof(bins->counts[i]));
    }
}

INLINED void add_box(struct bvh_bins *bins, const struct bvh_box *of, bvh_vec4 origin, bvh_vec4 scale,
                     bvh_vec4 last_bin, minimum *take_minimum)
{
    const bvh_vec4 zero = {0, 0, 0, 0}, place = (bvh_box_centre(of) - origin) * scale;
    /* In this order NaN becomes 0. */
    int4 bin = __builtin_convertvector(bvh_vec_min(bvh_vec_max(place, zero), last_bin), int4);
    corners box;
    corners_of(&box, of);
    const int x = bin[0], y = bin[1], z = bin[2];
    take_minimum(&bins->boxes[x][0], &box);
    take_minimum(&bins->boxes[y][1], &box);
    take_minimum(&bins->boxes[z][2], &box);
    bins->counts[x][0]++;
    bins->counts[y][1]++;
    bins->counts[z][2]++;
}

INLINED void add_bins(struct bvh_bins *sum, const struct bvh_bins *bins, minimum *take_minimum)
{
    for (int i = 0; i < sum->count; i++) {
        for (int axis = 0; axis < 3; axis++) {
            take_minimum(&sum->boxes[i][axis], &bins->boxes[i][axis]);
            sum->counts[i][axis] += bins->counts[i][axis];
        }
    }
}

/* Fills the bins. Neighbours mostly share bins and would wait for one another: in a long range each half has
 * bins of its own. */
INLINED void fill_bins(struct bvh_bins *bins, const struct bvh_box *boxes, uint32_t count, bvh_vec4 origin,
                       bvh_vec4 scale, minimum *take_minimum)
{
    const float last = (float)(bins->count - 1);
    const bvh_vec4 last_bin = {last, last, last, last};
    uint32_t i = 0;
    clear_bins(bins);
    if (count >= LARGE_RANGE) {
        struct bvh_bins others;
        const uint32_t half = count / 2;
        others.count = bins->count;
        clear_bins(&others);
        for (; i < half; i++) {
            add_box(bins, &boxes[i], origin, scale, last_bin, take_minimum);
            add_box(&others, &boxes[half + i], origin, scale, last_bin, take_minimum);
        }
        add_bins(bins, &others, take_minimum);
        i = 2 * half;
    }
    for (; i < count; i++)
        add_box(bins, &boxes[i], origin, scale, last_bin, take_minimum);
}

/* Half the surfaces of three boxes: a constant factor changes no choice. */
INLINED bvh_vec4 diagonal(const corners *of)
{
    return -__builtin_shufflevector(*of, *of, 4, 5, 6, 7) - __builtin_shufflevector(*of, *of, 0, 1, 2, 3);
}

INLINED bvh_vec4 box_areas(const corners of[3])
{
    const bvh_vec4 a = diagonal(&of[0]), b = diagonal(&of[1]), c = diagonal(&of[2]);
    bvh_vec4 xy = __builtin_shufflevector(a, b, 0, 4, 1, 5), zw = __builtin_shufflevector(a, b, 2, 6, 3, 7);
    bvh_vec4 x = __builtin_shufflevector(xy, c, 0, 1, 4, 4), y = __builtin_shufflevector(xy, c, 2, 3, 5, 5);
    bvh_vec4 z = __builtin_shufflevector(zw, c, 0, 1, 6, 6);
    return x * y + y * z + z * x;
}

INLINED void add_three(corners sum[3], const corners boxes[3], minimum *take_minimum)
{
    take_minimum(&sum[0], &boxes[0]);
    take_minimum(&sum[1], &boxes[1]);
    take_minimum(&sum[2], &boxes[2]);
}

INLINED struct best sweep(const struct bvh_bins *bins, minimum *take_minimum)
{
    bvh_vec4 area_right[BINS_MAX];
    corners sum[3] = {nothing, nothing, nothing};
    int4 total = counts_of(bins, 0), left = {0, 0, 0, 0};
    for (int i = bins->count - 1; i > 0; i--) {
        add_three(sum, bins->boxes[i], take_minimum);
        total += counts_of(bins, i);
        area_right[i] = box_areas(sum);
    }
    sum[0] = sum[1] = sum[2] = nothing;
    struct best best = {{FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX}, {0, 0, 0, 0}};
    for (int i = 1; i < bins->count; i++) {
        add_three(sum, bins->boxes[i - 1], take_minimum);
        left += counts_of(bins, i - 1);
        bvh_vec4 cost = box_areas(sum) * __builtin_convertvector(left, bvh_vec4) +
                        area_right[i] * __builtin_convertvector(total - left, bvh_vec4);
        /* The area of an empty side is meaningless. */
        int4 better = (cost < best.cost) & (left > 0) & (left < total);
        best.cost = choose(better, cost, best.cost);
        best.bin = (better & i) | (~better & best.bin);
    }
    return best;
}

INLINED int bin_count_of(uint32_t count)
{
    return count < SMALL_RANGE ? BINS_SMALL : BINS_MAX;
}

/* Bins per unit. */
INLINED bvh_vec4 scale_of(bvh_vec4 extent, int bin_count)
{
    bvh_vec4 scale = {0, 0, 0, 0};
    for (int axis = 0; axis < 3; axis++)
        scale[axis] = extent[axis] > 0 ? (float)bin_count / extent[axis] : 0;
    return scale;
}

INLINED struct bvh_split choose_split(const struct bvh_bins *bins, const struct bvh_box *centres, bvh_vec4 extent,
                                      bvh_vec4 scale, minimum *take_minimum)
{
    const struct best best = sweep(bins, take_minimum);
    struct bvh_split split = {.axis = -1, .cost = FLT_MAX};
    for (int axis = 0; axis < 3; axis++)
        if (extent[axis] > 0 && best.bin[axis] > 0 && best.cost[axis] < split.cost)
            split = (struct bvh_split){axis, best.cost[axis], centres->lower[axis], scale[axis],
                                       (float)best.bin[axis]};
    return split;
}

INLINED struct bvh_split find(const struct bvh_box *boxes, uint32_t count, const struct bvh_box *centres,
                              minimum *take_minimum)
{
    struct bvh_bins bins; /* filled as far as used */
    bins.count = bin_count_of(count);
    const bvh_vec4 extent = centres->upper - centres->lower, scale = scale_of(extent, bins.count);
    fill_bins(&bins, boxes, count, centres->lower, scale, take_minimum);
    return choose_split(&bins, centres, extent, scale, take_minimum);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static inline void minimum_at_once(corners *a, const corners *b)
{
    *a = (corners)_mm256_min_ps((__m256)*a, (__m256)*b);
}

__attribute__((target("avx2"))) static struct bvh_split find_wide(const struct bvh_box *boxes, uint32_t count,
                                                                  const struct bvh_box *centres)
{
    return find(boxes, count, centres, minimum_at_once);
}

__attribute__((target("avx2"))) static void fill_wide(struct bvh_bins *bins, const struct bvh_box *boxes,
                                                      uint32_t count, bvh_vec4 origin, bvh_vec4 scale)
{
    fill_bins(bins, boxes, count, origin, scale, minimum_at_once);
}
#endif

struct bvh_split bvh_split_find(const struct bvh_box *boxes, uint32_t count, const struct bvh_box *centres)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        return find_wide(boxes, count, centres);
#endif
    return find(boxes, count, centres, minimum_of_halves);
}

/* ---- splits by several threads ---- */

struct pieces {
    const struct bvh_box *boxes;
    uint32_t count;
    bvh_vec4 origin, scale;
    int bin_count;
    struct bvh_bins *bins; /* bins of each piece */
};

static void fill_piece(void *context, uint32_t piece)
{
    const struct pieces *pieces = context;
    const uint32_t begin = piece * BVH_PIECE, count = bvh_piece_end(piece, pieces->count) - begin;
    struct bvh_bins *bins = &pieces->bins[piece];
    bins->count = pieces->bin_count;
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) {
        fill_wide(bins, pieces->boxes + begin, count, pieces->origin, pieces->scale);
        return;
    }
#endif
    fill_bins(bins, pieces->boxes + begin, count, pieces->origin, pieces->scale, minimum_of_halves);
}

/* Counts the primitives that go left, whose bins are before the border, by the same arithmetic. */
static uint32_t count_left(const struct bvh_bins *bins, const struct bvh_split *split)
{
    uint32_t left = 0;
    for (int i = 0; i < (int)split->border; i++)
        left += (uint32_t)bins->counts[i][split->axis];
    return left;
}

struct bvh_bins *bvh_bins_alloc(uint32_t piece_count)
{
    return aligned_alloc(_Alignof(struct bvh_bins), piece_count * sizeof(struct bvh_bins));
}

struct bvh_split bvh_split_find_together(const struct bvh_box *boxes, uint32_t count,
                                         const struct bvh_box *centres, unsigned threads, struct bvh_bins *bins,
                                         uint32_t *lefts)
{
    const uint32_t piece_count = bvh_piece_count(count);
    const bvh_vec4 extent = centres->upper - centres->lower;
    struct pieces pieces = {.boxes = boxes,
                            .count = count,
                            .origin = centres->lower,
                            .scale = scale_of(extent, bin_count_of(count)),
                            .bin_count = bin_count_of(count),
                            .bins = bins};
    parallel_run(threads, piece_count, fill_piece, &pieces);
    struct bvh_bins sum = bins[0];
    for (uint32_t piece = 1; piece < piece_count; piece++)
        add_bins(&sum, &bins[piece], minimum_of_halves);
    const struct bvh_split split = choose_split(&sum, centres, extent, pieces.scale, minimum_of_halves);
    for (uint32_t piece = 0; split.axis >= 0 && piece < piece_count; piece++)
        lefts[piece] = count_left(&bins[piece], &split);
    return split;
}
