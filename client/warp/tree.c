/* SPDX-License-Identifier: MIT */
/* Widmer and others, section 3.3, as nodes.comp of the tracer `quadtree` has it, level by level: node for node the
 * same bits, if the leaves are. These come from differences of depths here, as the client knows no primitives. */
#include "warp/tree.h"

#include "warp/lanes.h"
#include "warp/node.h"

#include <stdlib.h>

/* Two differences of w to the neighbours on both sides are one slope if they are as different as this share of the
 * smaller one: then it is their mean. */
#define SLOPE_SHARE 0.5f
/* Else the surface goes on to one side, where the difference is smaller, if that is no more than this share of w:
 * more is a step on both sides. */
#define STEP_SHARE 0.02f
/* Of the greatest w of four texels: they show one surface if they differ by no more. */
#define JOINED_SHARE 0.03f
#define WORD 32 /* texels whose `joined` share a word */
/* As in nodes.comp. */
#define ROUNDING 2.384e-7f
#define SLOPE_ROUNDING 9.766e-4f
#define SLOPE_STEP (6.104e-5f / QUADTREE_SLOPE_SCALE)

/* ---- memory ---- */

static uint32_t padded(uint32_t size)
{
    return (size + QUADTREE_SIDE - 1) / QUADTREE_SIDE * QUADTREE_SIDE;
}

uint32_t warp_layer_nodes(const struct warp_layer *layer)
{
    const uint32_t texels = layer->padded_width * layer->padded_height;
    return node_level_first(texels, QUADTREE_TOP) + (texels >> 2 * QUADTREE_TOP);
}

bool warp_layer_init(struct warp_layer *layer, uint32_t width, uint32_t height)
{
    *layer = (struct warp_layer){
        .width = width, .height = height, .padded_width = padded(width), .padded_height = padded(height)};
    const uint32_t texels = layer->padded_width * layer->padded_height;
    const uint32_t nodes = warp_layer_nodes(layer);
    uint32_t blocks = 0;
    for (uint32_t level = WARP_BLOCK_LOW; level <= QUADTREE_TOP; level++) {
        layer->block_first[level] = blocks;
        blocks += texels >> 2 * level;
    }
    layer->colours = calloc((size_t)texels + layer->padded_width + 1,
                            sizeof(*layer->colours)); /* the next texel, and the next row */
    layer->w = calloc(texels, sizeof(*layer->w));
    layer->joined = calloc(texels / WORD, sizeof(*layer->joined));
    layer->nodes = calloc(nodes, 2 * sizeof(*layer->nodes));
    layer->errors = calloc(nodes - texels, sizeof(*layer->errors));
    layer->blocks = calloc(blocks, sizeof(*layer->blocks));
    if (!layer->colours || !layer->w || !layer->joined || !layer->nodes || !layer->errors || !layer->blocks)
        return false;
    for (uint32_t i = 0; i < nodes; i++)
        layer->nodes[2 * (size_t)i] = NODE_NOTHING;
    return true;
}

void warp_layer_finish(struct warp_layer *layer)
{
    free(layer->colours);
    free(layer->w);
    free(layer->joined);
    free(layer->nodes);
    free(layer->errors);
    free(layer->blocks);
    *layer = (struct warp_layer){0};
}

/* ---- leaves ---- */

/* Of a row, `left` to `right`: slopes as they are in nodes, and the words that hold them. */
struct slope_row {
    float *x, *y;
    uint32_t *tails;
};

/* Columns of a row. */
struct span {
    int first, end;
};

/* Rows of slopes round the one whose leaves are made, and what blocks need. */
struct scratch {
    struct slope_row rows[3];
    float *w_min, *w_max, *steep_x, *steep_y;
};

#define SCRATCH_ROWS 13u

size_t warp_layer_scratch(const struct warp_layer *layer)
{
    return (size_t)SCRATCH_ROWS * layer->padded_width;
}

static struct slope_row slope_row_of(float *memory, size_t row)
{
    return (struct slope_row){memory, memory + row, (uint32_t *)(void *)(memory + 2 * row)};
}

static struct scratch scratch_of(const struct warp_layer *layer, float *memory)
{
    const size_t row = layer->padded_width;
    return (struct scratch){.rows = {slope_row_of(memory, row), slope_row_of(memory + 3 * row, row),
                                     slope_row_of(memory + 6 * row, row)},
                            .w_min = memory + 9 * row,
                            .w_max = memory + 10 * row,
                            .steep_x = memory + 11 * row,
                            .steep_y = memory + 12 * row};
}

/* The rows take turns. */
static const struct slope_row *slopes_at(const struct scratch *scratch, uint32_t y)
{
    return &scratch->rows[y % 3];
}

/* Of w at a texel from the differences to its neighbours: from the one before it and to the one after it. */
LANES_INLINE float slope_of(float w, float before, float after, float noise)
{
    const float a = magnitude(before), b = magnitude(after), smaller = a < b ? before : after;
    const int is_one = magnitude(before - after) <= SLOPE_SHARE * min_of(a, b) + noise;
    const int is_step = min_of(a, b) > STEP_SHARE * w;
    return is_one ? 0.5f * (before + after) : is_step ? 0 : smaller;
}

/* The word with the slopes at a texel, of w there, and to the left, to the right, above and below. */
LANES_INLINE uint32_t slopes_of(float w, float left, float right, float above, float below, float noise)
{
    const float x = slope_of(w, w - left, right - w, noise), y = slope_of(w, w - above, below - w, noise);
    return w > 0 ? plane_tail(x, y) : 0;
}

/* Beyond the border the surface goes on as it is on this side. */
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

static void find_slopes(const struct warp_layer *layer, const struct slope_row *row, uint32_t y, struct span span)
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

/* How far the planes of two leaves differ in the middle of their border; b lies to the right of a, or below. */
LANES_INLINE uint32_t is_edge(float w_a, float w_b, float slope_a, float slope_b, float slack)
{
    return mask_of(magnitude(w_b - w_a - 0.5f * (slope_a + slope_b)) >
                   QUADTREE_EDGE_SHARE * max_of(w_a, w_b) + slack);
}

/* What the leaves of a row are made of. Of a row of texels that is not there: the row itself, with a mask of no
 * bits. */
struct leaf_row {
    const float *above, *w, *below;
    const float *up, *along_y, *down;     /* slopes along y, of the three rows */
    const float *along_x, *along_x_below; /* along x */
    const uint32_t *tails;
    uint32_t has_above, has_below;
    float slack, noise;
    uint32_t *nodes;
};

/* A neighbour that is not there is the texel itself. */
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

static struct leaf_row leaf_row_of(const struct warp_layer *layer, const struct scratch *scratch, uint32_t y)
{
    const struct slope_row *here = slopes_at(scratch, y), *next = slopes_at(scratch, y + 1);
    const size_t across = layer->padded_width;
    const float *w = layer->w + y * across;
    const bool has_above = y > 0, has_below = y + 1 < layer->height;
    return (struct leaf_row){.above = has_above ? w - across : w,
                             .w = w,
                             .below = has_below ? w + across : w,
                             .up = slopes_at(scratch, y + 2)->y, /* of y - 1 */
                             .along_y = here->y,
                             .down = next->y,
                             .along_x = here->x,
                             .along_x_below = next->x,
                             .tails = here->tails,
                             .has_above = mask_of(has_above),
                             .has_below = mask_of(has_below),
                             .slack = layer->tolerance + 2 * layer->noise,
                             .noise = 2 * layer->noise,
                             .nodes = layer->nodes + 2 * y * across};
}

static void make_leaves(const struct leaf_row *row, struct span span, int last)
{
    const bool has_first = span.first == 0, has_last = span.end == last + 1;
    make_inner_leaves(row, (struct span){span.first + has_first, span.end - has_last});
    if (has_first)
        make_leaf(row, 0, 0, last > 0 ? 1 : 0);
    if (has_last && last > 0)
        make_leaf(row, last, last - 1, last);
}

/* Whether four texels show one surface: they are close to one another, or go on from one another however steeply.
 */
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

/* Of a word's texels from the first on, all of which have neighbours. */
LANES_KERNEL static uint32_t join_word(const struct leaf_row *given, int first)
{
    const struct leaf_row row = *given;
    uint32_t word = 0;
#pragma omp simd reduction(| : word)
    for (int i = 0; i < WORD; i++)
        word |= (is_joined(&row, first + i) & 1u) << i;
    return word;
}

/* The last texel of a row, and all of the last row, have no neighbours. */
static void join_texels(const struct leaf_row *row, uint32_t *words, struct span span, int last)
{
    for (int x = span.first; x < span.end; x += WORD) {
        uint32_t word = 0;
        if (row->has_below && x + WORD <= last)
            word = join_word(row, x);
        else
            for (int i = 0; row->has_below && i < WORD && x + i < last; i++)
                word |= (is_joined(row, x + i) & 1u) << i;
        words[x / WORD] = word;
    }
}

/* ---- blocks ---- */

LANES_KERNEL static void gather_row(const struct warp_layer *layer, const struct scratch *scratch, uint32_t y,
                                    struct span span)
{
    const size_t across = layer->padded_width;
    const int last = (int)layer->width - 1;
    const float *w = layer->w + y * across, *below = y + 1 < layer->height ? w + across : w;
    const float *slope_x = slopes_at(scratch, y)->x, *slope_y = slopes_at(scratch, y)->y;
    float *restrict w_min = scratch->w_min, *restrict w_max = scratch->w_max;
    float *restrict steep_x = scratch->steep_x, *restrict steep_y = scratch->steep_y;
    const int is_first = y % (1u << WARP_BLOCK_LOW) == 0;
#pragma omp simd
    for (int x = span.first; x < span.end; x++) {
        const float reach = 0.5f * (magnitude(slope_x[x]) + magnitude(slope_y[x]));
        const float low = max_of(w[x] - reach, 0), high = w[x] + reach;
        const float to_right = magnitude(w[x + (x < last)] - w[x]), to_below = magnitude(below[x] - w[x]);
        w_min[x] = is_first ? low : min_of(low, w_min[x]);
        w_max[x] = is_first ? high : max_of(high, w_max[x]);
        steep_x[x] = is_first ? to_right : max_of(to_right, steep_x[x]);
        steep_y[x] = is_first ? to_below : max_of(to_below, steep_y[x]);
    }
}

void warp_block_join(struct warp_block *block, const struct warp_block *other)
{
    block->w_min = min_of(block->w_min, other->w_min);
    block->w_max = max_of(block->w_max, other->w_max);
    block->steep_x = max_of(block->steep_x, other->steep_x);
    block->steep_y = max_of(block->steep_y, other->steep_y);
}

/* Of the rows that were gathered. */
static void make_low_blocks(struct warp_layer *layer, const struct scratch *scratch, uint32_t y, struct span span)
{
    const int side = 1 << WARP_BLOCK_LOW;
    struct warp_block *row =
        layer->blocks + (size_t)(y >> WARP_BLOCK_LOW) * (layer->padded_width >> WARP_BLOCK_LOW);
    for (int first = span.first; first < span.end; first += side) {
        struct warp_block block = {scratch->w_min[first], scratch->w_max[first], scratch->steep_x[first],
                                   scratch->steep_y[first]};
        for (int x = first + 1; x < first + side && x < span.end; x++)
            warp_block_join(&block, &(struct warp_block){scratch->w_min[x], scratch->w_max[x], scratch->steep_x[x],
                                                         scratch->steep_y[x]});
        row[first >> WARP_BLOCK_LOW] = block;
    }
}

/* A row of a level from the level below it; what lies beyond the picture is in none. */
static void make_blocks(struct warp_layer *layer, uint32_t level, uint32_t y, struct span span)
{
    const uint32_t across = layer->padded_width >> level, side = 1u << (level - 1);
    const struct warp_block *below = layer->blocks + layer->block_first[level - 1] + (size_t)4 * across * y;
    struct warp_block *row = layer->blocks + layer->block_first[level] + (size_t)across * y;
    for (uint32_t x = (uint32_t)span.first >> level; x << level < (uint32_t)span.end; x++) {
        const bool has_right = (2 * x + 1) * side < layer->width, has_below = (2 * y + 1) * side < layer->height;
        struct warp_block block = below[2 * x];
        if (has_right)
            warp_block_join(&block, &below[2 * x + 1]);
        if (has_below)
            warp_block_join(&block, &below[2 * (across + x)]);
        if (has_right && has_below)
            warp_block_join(&block, &below[2 * (across + x) + 1]);
        row[x] = block;
    }
}

/* ---- nodes ---- */

/* What is the same for all nodes of a row. */
struct merge_terms {
    float h; /* half a side of a child: also from the centre of the node to those of the children */
    float tolerance, nearness;
    float of_leaves, of_nodes;                /* 1 where the children are these, else 0: no branches in lanes */
    const uint32_t *upper, *lower;            /* two rows of children: their words .. */
    const float *upper_errors, *lower_errors; /* .. and how far their planes are off at most */
};

/* An eye that is up to the radius nearer to the surface sees a difference of w as more pixels. */
LANES_INLINE float tolerance_of(const struct merge_terms *terms, float w_max)
{
    const float near = max_of(1 - terms->nearness * w_max, 0);
    return terms->tolerance * near * near;
}

LANES_INLINE void merge(const struct merge_terms *terms, int x, uint32_t *node, float *node_error)
{
    const uint32_t *upper = terms->upper + 4 * (size_t)x, *lower = terms->lower + 4 * (size_t)x;
    const uint32_t head[4] = {upper[0], upper[2], lower[0], lower[2]};
    const uint32_t tail[4] = {upper[1], upper[3], lower[1], lower[3]};
    const float *upper_errors = terms->upper_errors + 2 * x, *lower_errors = terms->lower_errors + 2 * x;
    const float child_error[4] = {upper_errors[0], upper_errors[1], lower_errors[0], lower_errors[1]};
    const float h = terms->h;
    float w4[4], sx[4], sy[4], error[4], reach[4];
    int all_planes = 1, all_something = 1, any_something = 0;
    for (int i = 0; i < 4; i++) {
        w4[i] = plane_w(head[i]);
        sx[i] = plane_slope_x(tail[i]);
        sy[i] = plane_slope_y(tail[i]);
        reach[i] = (magnitude(sx[i]) + magnitude(sy[i])) * h;
        /* Rounding of the leaves themselves, whose exact planes are known no more. */
        const float rounding = w4[i] * ROUNDING + (reach[i] * SLOPE_ROUNDING + 2 * h * SLOPE_STEP);
        error[i] = terms->of_nodes * child_error[i] + terms->of_leaves * (w4[i] > 0 ? rounding : 0);
        all_planes &= node_is_plane(head[i]);
        all_something &= w4[i] > 0;
        any_something |= w4[i] > 0;
    }
    /* Least squares of w at the four centres. */
    const uint32_t flag = (head[0] | head[1] | head[2] | head[3]) & 1u;
    const uint32_t merged_tail = plane_tail((((w4[1] - w4[0]) - w4[2]) + w4[3]) * (0.25f / h),
                                            (((w4[2] - w4[0]) - w4[1]) + w4[3]) * (0.25f / h));
    const uint32_t merged_head = plane_head((((w4[0] + w4[1]) + w4[2]) + w4[3]) * 0.25f, flag);
    const float w = plane_w(merged_head), slope_x = plane_slope_x(merged_tail),
                slope_y = plane_slope_y(merged_tail);
    float off[4], high[4], low[4];
    for (int i = 0; i < 4; i++) {
        const float side_x = i & 1 ? 1 : -1, side_y = i >> 1 ? 1 : -1;
        off[i] = magnitude(w + h * (slope_x * side_x + slope_y * side_y) - w4[i]) +
                 (h * (magnitude(slope_x - sx[i]) + magnitude(slope_y - sy[i])) + error[i]);
        /* Also over the planes below, which rays are tested against. */
        high[i] = node_is_plane(head[i]) ? w4[i] + reach[i] + error[i] : float_from_bits(head[i]);
        low[i] = node_is_plane(head[i]) ? w4[i] - reach[i] - error[i] : float_from_bits(tail[i]);
    }
    const float w_max = w + 2 * h * (magnitude(slope_x) + magnitude(slope_y)) + terms->tolerance;
    const float worst = max_of_4(off) + ROUNDING * w_max;
    const int merges = all_planes & all_something & (worst <= tolerance_of(terms, w_max));
    const int is_plane = merges | (all_planes & !any_something);
    node[0] = is_plane ? merged_head : bits_of(max_of(max_of_4(high), 0));
    node[1] = is_plane ? merged_tail : bits_of(max_of(min_of_4(low), 0));
    *node_error = merges ? worst : 0;
}

LANES_KERNEL static void merge_row(struct warp_layer *layer, uint32_t level, uint32_t y, struct span span)
{
    const uint32_t texels = layer->padded_width * layer->padded_height, across = layer->padded_width >> level;
    const size_t below = node_level_first(texels, level - 1) + (size_t)4 * across * y;
    const size_t here = node_level_first(texels, level) + (size_t)across * y;
    /* Leaves have no errors: any others are read in their place, and do not count. */
    const float *child_errors = layer->errors + (level == 1 ? 0 : below - texels);
    const struct merge_terms terms = {.h = 0.25f * (float)(1u << level),
                                      .tolerance = layer->tolerance,
                                      .nearness = layer->nearness,
                                      .of_leaves = level == 1,
                                      .of_nodes = level > 1,
                                      .upper = layer->nodes + 2 * below,
                                      .lower = layer->nodes + 2 * (below + 2 * across),
                                      .upper_errors = child_errors,
                                      .lower_errors = child_errors + (level == 1 ? 0 : 2 * across)};
    uint32_t *restrict nodes = layer->nodes + 2 * here;
    float *restrict errors = layer->errors + (here - texels);
    const int first = span.first >> level, end = span.end >> level;
#pragma omp simd
    for (int x = first; x < end; x++)
        merge(&terms, x, nodes + 2 * (size_t)x, errors + x);
}

/* ---- parts ---- */

/* Slopes look one texel far, and edges at the slopes of the next one. */
#define SEEN_TEXELS 2u

struct warp_rectangle warp_layer_parts(const struct warp_layer *layer, const struct warp_rectangle *texels)
{
    const uint32_t right = texels->right + SEEN_TEXELS, bottom = texels->bottom + SEEN_TEXELS;
    return (struct warp_rectangle){
        .left = (texels->left > SEEN_TEXELS ? texels->left - SEEN_TEXELS : 0) / QUADTREE_SIDE,
        .top = (texels->top > SEEN_TEXELS ? texels->top - SEEN_TEXELS : 0) / QUADTREE_SIDE,
        .right = padded(right < layer->width ? right : layer->width) / QUADTREE_SIDE,
        .bottom = padded(bottom < layer->height ? bottom : layer->height) / QUADTREE_SIDE};
}

void warp_layer_build(struct warp_layer *layer, uint32_t row, uint32_t left, uint32_t right, float *scratch_memory)
{
    struct scratch scratch = scratch_of(layer, scratch_memory);
    const uint32_t first = row * QUADTREE_SIDE, end = first + QUADTREE_SIDE;
    const int width = (int)layer->width;
    const struct span nodes = {(int)(left * QUADTREE_SIDE), (int)(right * QUADTREE_SIDE)};
    const struct span texels = {nodes.first, nodes.end < width ? nodes.end : width};
    const struct span slopes = {texels.first > 0 ? texels.first - 1 : 0,
                                texels.end < width ? texels.end + 1 : width};
    const uint32_t block = 1u << WARP_BLOCK_LOW;
    if (first > 0)
        find_slopes(layer, slopes_at(&scratch, first - 1), first - 1, slopes);
    find_slopes(layer, slopes_at(&scratch, first), first, slopes);
    for (uint32_t y = first; y < end && y < layer->height; y++) {
        if (y + 1 < layer->height)
            find_slopes(layer, slopes_at(&scratch, y + 1), y + 1, slopes);
        const struct leaf_row leaves = leaf_row_of(layer, &scratch, y);
        make_leaves(&leaves, texels, width - 1);
        join_texels(&leaves, layer->joined + (size_t)y * (layer->padded_width / WORD), texels, width - 1);
        gather_row(layer, &scratch, y, texels);
        if (y % block == block - 1 || y + 1 == layer->height)
            make_low_blocks(layer, &scratch, y, texels);
    }
    for (uint32_t level = WARP_BLOCK_LOW + 1; level <= QUADTREE_TOP; level++)
        for (uint32_t y = first >> level; y < end >> level && y << level < layer->height; y++)
            make_blocks(layer, level, y, texels);
    for (uint32_t level = 1; level <= QUADTREE_TOP; level++)
        for (uint32_t y = first >> level; y < end >> level; y++)
            merge_row(layer, level, y, nodes);
}
