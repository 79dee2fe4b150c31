/* SPDX-License-Identifier: MIT */
/* Finds where a range of primitives is best cut in two: the surface area heuristic over bins of the primitives'
 * centres, with the three axes in the lanes of a register. Private to the builder. */
#ifndef FARLIGHT_TRACE_TREE_BUILD_SPLIT_H
#define FARLIGHT_TRACE_TREE_BUILD_SPLIT_H

#include "trace/tree/build.h"

#include <float.h>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

struct bvh_split {
    int axis;            /* -1: none found */
    float cost;          /* half surfaces times primitives, over both sides */
    float origin, scale; /* primitives with (centre - origin) scale below `border` go left */
    float border;
};

/* Finds the cheapest cut of boxes[0 .. count - 1], whose centres lie in `centres`. */
struct bvh_split bvh_split_find(const struct bvh_box *boxes, uint32_t count, const struct bvh_box *centres);

/* ---- by several threads, piece by piece ---- */

#define BVH_PIECE 16384u /* primitives that a thread takes at a time */

struct bvh_bins;                                       /* bins of one piece */
struct bvh_bins *bvh_bins_alloc(uint32_t piece_count); /* for free(); NULL: no memory */
/* Finds the same cut with several threads. `bins` and `lefts` have an entry for each piece: working memory, and
 * the number of its primitives that go left. */
struct bvh_split bvh_split_find_together(const struct bvh_box *boxes, uint32_t count,
                                         const struct bvh_box *centres, unsigned threads, struct bvh_bins *bins,
                                         uint32_t *lefts);

static inline uint32_t bvh_piece_count(uint32_t count)
{
    return count / BVH_PIECE + (count % BVH_PIECE > 0);
}
static inline uint32_t bvh_piece_end(uint32_t piece, uint32_t count)
{
    return count - piece * BVH_PIECE < BVH_PIECE ? count : (piece + 1) * BVH_PIECE;
}

#if defined(__SSE__)
static inline bvh_vec4 bvh_vec_min(bvh_vec4 a, bvh_vec4 b)
{
    return (bvh_vec4)_mm_min_ps((__m128)a, (__m128)b);
}
static inline bvh_vec4 bvh_vec_max(bvh_vec4 a, bvh_vec4 b)
{
    return (bvh_vec4)_mm_max_ps((__m128)a, (__m128)b);
}
#else
/* Minimum by SSE's rule: the second where either is NaN. */
static inline bvh_vec4 bvh_vec_min(bvh_vec4 a, bvh_vec4 b)
{
    for (int i = 0; i < 4; i++)
        a[i] = a[i] < b[i] ? a[i] : b[i];
    return a;
}
static inline bvh_vec4 bvh_vec_max(bvh_vec4 a, bvh_vec4 b)
{
    for (int i = 0; i < 4; i++)
        a[i] = a[i] > b[i] ? a[i] : b[i];
    return a;
}
#endif

static inline struct bvh_box bvh_box_empty(void)
{
    return (struct bvh_box){{FLT_MAX, FLT_MAX, FLT_MAX, 0}, {-FLT_MAX, -FLT_MAX, -FLT_MAX, 0}};
}

static inline void bvh_box_add(struct bvh_box *box, const struct bvh_box *other)
{
    box->lower = bvh_vec_min(box->lower, other->lower);
    box->upper = bvh_vec_max(box->upper, other->upper);
}

static inline bvh_vec4 bvh_box_centre(const struct bvh_box *box)
{
    return 0.5f * box->lower + 0.5f * box->upper; /* halves first: the sum of two large numbers would be
                                                     infinite */
}

/* Whether a primitive goes left. A place that is NaN (infinite extent times zero) is on the left, as it is in
 * bin 0. */
static inline bool bvh_split_goes_left(const struct bvh_split *split, const struct bvh_box *box)
{
    const float *lower = (const float *)&box->lower, *upper = (const float *)&box->upper;
    float centre = 0.5f * lower[split->axis] + 0.5f * upper[split->axis]; /* by the formula of bvh_box_centre() */
    return !((centre - split->origin) * split->scale >= split->border);
}

#endif
