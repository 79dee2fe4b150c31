/* SPDX-License-Identifier: MIT */
/* Planes of the leaves. Slopes come from differences of depths, as the client knows no primitives. A texel and
 * a neighbour that do not continue each other both get the flag O of the paper. */
#include "warp/leaves.h"

#include "warp/lanes.h"
#include "warp/node.h"

/* Two differences of w, to the neighbours on both sides, form one slope, their mean, if they differ by at most
 * this share of the smaller one. */
#define SLOPE_SHARE 0.5f
/* Otherwise the surface continues to the side with the smaller difference if that is at most this share of w; a
 * larger one is a step on both sides. */
#define STEP_SHARE 0.02f
/* Four texels show one surface if they differ by at most this share of their maximum w. */
#define JOINED_SHARE 0.03f

/* Slope of w at a texel from the differences to its neighbours: from the previous one and to the next one. */
LANES_INLINE float slope_of(float w, float before, float after, float noise)
{
    const float a = magnitude(before), b = magnitude(after), smaller = a < b ? before : after;
    const int is_one = magnitude(before - after) <= SLOPE_SHARE * min_of(a, b) + noise;
    const int is_step = min_of(a, b) > STEP_SHARE * w;
    return is_one ? 0.5f * (before + after) : is_step ? 0 : smaller;
}

/* Packs the slopes at a texel from w there, to the left, to the right, above and below. */
LANES_INLINE uint32_t slopes_of(float w, float left, float right, float above, float below, float noise)
{
    const float x = slope_of(w, w - left, right - w, noise), y = slope_of(w, w - above, below - w, noise);
    return w > 0 ? plane_tail(x, y) : 0;
}

/* Beyond the border the surface continues with the slope on this side. */
static void find_slope_at_border(const struct warp_layer *layer, const struct slope_row *row, uint32_t x,
                                 uint32_t y)
{
    const size_t across = layer->padded_width;
    const float *w = layer->w + y * across + x;
    const float *left = x > 0 ? w - 1 : w, *right = x + 1 < layer->width ? w + 1 : w;
    const float *above = y > 0 ? w - across : w, *below = y + 1 < layer->height ? w + across : w;
    const float l = left == w ? *w + *w - *right : *left, r = right == w ? *w + *w - *left : *right;
    const float a = above == w ? *w + *w - *below : *above, b = below == w ? *w + *w - *above : *below;
    const uint32_t tail = slopes_of(*w, l, r, a, b, 2 * layer->noise);
    row->tails[x] = tail;
    row->x[x] = plane_slope_x(tail);
    row->y[x] = plane_slope_y(tail);
}

LANES_KERNEL static void find_inner_slopes(const struct warp_layer *layer, const struct slope_row *row, uint32_t y,
                                           struct span span)
{
    const size_t across = layer->padded_width;
    const float *w = layer->w + y * across, *above = w - across, *below = w + across, noise = 2 * layer->noise;
    float *restrict slopes_x = row->x, *restrict slopes_y = row->y;
    uint32_t *restrict tails = row->tails;
#pragma omp simd
    for (int x = span.first; x < span.end; x++) {
        const uint32_t tail = slopes_of(w[x], w[x - 1], w[x + 1], above[x], below[x], noise);
        tails[x] = tail;
        slopes_x[x] = plane_slope_x(tail);
        slopes_y[x] = plane_slope_y(tail);
    }
}

void warp_find_slopes(const struct warp_layer *layer, const struct slope_row *row, uint32_t y, struct span span)
{
    const int last = (int)layer->width - 1;
    const bool is_border = y == 0 || y + 1 == layer->height;
    struct span inner = {span.first > 0 ? span.first : 1, span.end < last ? span.end : last};
    if (is_border || inner.first > inner.end)
        inner.first = inner.end = span.end;
    else
        find_inner_slopes(layer, row, y, inner);
    for (int x = span.first; x < span.end; x++)
        if (x < inner.first || x >= inner.end)
            find_slope_at_border(layer, row, (uint32_t)x, y);
}

/* True if the planes of two leaves differ too much at the middle of their border; b lies to the right of a, or
 * below. */
LANES_INLINE uint32_t is_edge(float w_a, float w_b, float slope_a, float slope_b, float slack)
{
    return mask_of(magnitude(w_b - w_a - 0.5f * (slope_a + slope_b)) >
                   QUADTREE_EDGE_SHARE * max_of(w_a, w_b) + slack);
}

/* The inputs of a row of leaves. A missing row of texels is replaced by the row itself, with a mask of no bits. */
struct leaf_row {
    const float *above, *w, *below;
    const float *up, *along_y, *down;     /* slopes along y, of the three rows */
    const float *along_x, *along_x_below; /* slopes along x */
    const uint32_t *tails;
    uint32_t has_above, has_below;
    float slack, noise;
    uint32_t *nodes;
};

/* A missing neighbour is replaced by the texel itself. */
LANES_INLINE void make_leaf(const struct leaf_row *row, int x, int left, int right)
{
    const float *w = row->w, *across = row->along_x, slack = row->slack;
    const uint32_t edge = (is_edge(w[left], w[x], across[left], across[x], slack) & mask_of(left < x)) |
                          (is_edge(w[x], w[right], across[x], across[right], slack) & mask_of(right > x)) |
                          (is_edge(row->above[x], w[x], row->up[x], row->along_y[x], slack) & row->has_above) |
                          (is_edge(w[x], row->below[x], row->along_y[x], row->down[x], slack) & row->has_below);
    row->nodes[2 * x] = plane_head(w[x], edge & mask_of(w[x] > 0) & 1u);
    row->nodes[2 * x + 1] = row->tails[x];
}

LANES_KERNEL static void make_inner_leaves(const struct leaf_row *given, struct span span)
{
    const struct leaf_row row = *given;
#pragma omp simd
    for (int x = span.first; x < span.end; x++)
        make_leaf(&row, x, x - 1, x + 1);
}

static struct leaf_row leaf_row_of(const struct warp_layer *layer, const struct slope_rows *rows, uint32_t y)
{
    const size_t across = layer->padded_width;
    const float *w = layer->w + y * across;
    const bool has_above = y > 0, has_below = y + 1 < layer->height;
    return (struct leaf_row){.above = has_above ? w - across : w,
                             .w = w,
                             .below = has_below ? w + across : w,
                             .up = rows->above->y,
                             .along_y = rows->here->y,
                             .down = rows->below->y,
                             .along_x = rows->here->x,
                             .along_x_below = rows->below->x,
                             .tails = rows->here->tails,
                             .has_above = mask_of(has_above),
                             .has_below = mask_of(has_below),
                             .slack = layer->tolerance + 2 * layer->noise,
                             .noise = 2 * layer->noise,
                             .nodes = layer->nodes + 2 * y * across};
}

static void make_row(const struct leaf_row *row, struct span span, int last)
{
    const bool has_first = span.first == 0, has_last = span.end == last + 1;
    make_inner_leaves(row, (struct span){span.first + has_first, span.end - has_last});
    if (has_first)
        make_leaf(row, 0, 0, last > 0 ? 1 : 0);
    if (has_last && last > 0)
        make_leaf(row, last, last - 1, last);
}

/* True if four texels show one surface: they are close to each other, or continue each other however steeply. */
LANES_INLINE uint32_t is_joined(const struct leaf_row *row, int x)
{
    const float a = row->w[x], b = row->w[x + 1], c = row->below[x], d = row->below[x + 1], slack = row->slack;
    const float high = max_of(max_of(a, b), max_of(c, d)), low = min_of(min_of(a, b), min_of(c, d));
    const uint32_t edge = is_edge(a, b, row->along_x[x], row->along_x[x + 1], slack) |
                          is_edge(c, d, row->along_x_below[x], row->along_x_below[x + 1], slack) |
                          is_edge(a, c, row->along_y[x], row->down[x], slack) |
                          is_edge(b, d, row->along_y[x + 1], row->down[x + 1], slack);
    return mask_of(high - low <= JOINED_SHARE * high + row->noise) | (~edge & mask_of(low > 0));
}

/* Finds the bits of a word of texels that all have neighbours. */
LANES_KERNEL static uint32_t join_word(const struct leaf_row *given, int first)
{
    const struct leaf_row row = *given;
    uint32_t word = 0;
#pragma omp simd reduction(| : word)
    for (int i = 0; i < WARP_JOINED_WORD; i++)
        word |= (is_joined(&row, first + i) & 1u) << i;
    return word;
}

/* The last texel of a row and the last row have no neighbours. */
static void join_texels(const struct leaf_row *row, uint32_t *words, struct span span, int last)
{
    for (int x = span.first; x < span.end; x += WARP_JOINED_WORD) {
        uint32_t word = 0;
        if (row->has_below && x + WARP_JOINED_WORD <= last)
            word = join_word(row, x);
        else
            for (int i = 0; row->has_below && i < WARP_JOINED_WORD && x + i < last; i++)
                word |= (is_joined(row, x + i) & 1u) << i;
        words[x / WARP_JOINED_WORD] = word;
    }
}

void warp_make_leaves(struct warp_layer *layer, const struct slope_rows *rows, uint32_t y, struct span span)
{
    const struct leaf_row row = leaf_row_of(layer, rows, y);
    const int last = (int)layer->width - 1;
    make_row(&row, span, last);
    join_texels(&row, layer->joined + (size_t)y * (layer->padded_width / WARP_JOINED_WORD), span, last);
}
