/* SPDX-License-Identifier: MIT */
/* The quadtree (Widmer and others, section 3.3), built level by level as in nodes.comp of the tracer
 * `quadtree`: equal leaves give equal bits in all nodes. */
#include "warp/tree.h"

#include "warp/lanes.h"
#include "warp/leaves.h"
#include "warp/node.h"

#include <stdlib.h>

/* The constants of nodes.comp. */
#define ROUNDING 2.384e-7f
#define SLOPE_ROUNDING 9.766e-4f
#define NO_LIMIT 3.4e38f
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
                            sizeof(*layer->colours)); /* for reading beyond the last texel and the last row */
    layer->w = calloc(texels, sizeof(*layer->w));
    layer->sticking = calloc(texels, sizeof(*layer->sticking));
    layer->joined = calloc(texels / WARP_JOINED_WORD, sizeof(*layer->joined));
    layer->nodes = calloc(nodes, 2 * sizeof(*layer->nodes));
    layer->errors = calloc((size_t)nodes - texels + layer->padded_width, sizeof(*layer->errors));
    layer->blocks = calloc(blocks, sizeof(*layer->blocks));
    if (!layer->colours || !layer->w || !layer->sticking || !layer->joined || !layer->nodes || !layer->errors ||
        !layer->blocks)
        return false;
    for (uint32_t i = 0; i < nodes; i++)
        layer->nodes[2 * (size_t)i] = NODE_NOTHING;
    return true;
}

void warp_layer_finish(struct warp_layer *layer)
{
    free(layer->colours);
    free(layer->w);
    free(layer->sticking);
    free(layer->joined);
    free(layer->nodes);
    free(layer->errors);
    free(layer->blocks);
    *layer = (struct warp_layer){0};
}

/* ---- rows ---- */

/* Rows of slopes around the row of leaves, and inputs of the blocks. */
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

/* The rows are used in turn. */
static const struct slope_row *slopes_at(const struct scratch *scratch, uint32_t y)
{
    return &scratch->rows[y % 3];
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

/* Makes the lowest blocks from the gathered rows. */
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

/* Makes a row of a level from the level below; blocks beyond the picture are left out. */
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

/* Parameters of all nodes of a row. */
struct merge_terms {
    float h; /* half the side of a child, which is also the distance from the node's centre to the children's */
    float tolerance, nearness;
    float of_leaves;                          /* 1 if the children are leaves, else 0; lanes have no branches */
    const uint32_t *upper, *lower;            /* two rows of children: their words .. */
    const float *upper_errors, *lower_errors; /* .. and the maximum errors of their planes */
};

/* An eye that is nearer to the surface by up to the radius sees a difference of w as more pixels. */
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
    uint32_t gaps = 0; /* the sign bit if there are gaps */
    int all_planes = 1, all_something = 1, any_something = 0;
    for (int i = 0; i < 4; i++) {
        w4[i] = plane_w(head[i]);
        sx[i] = plane_slope_x(tail[i]);
        sy[i] = plane_slope_y(tail[i]);
        reach[i] = (magnitude(sx[i]) + magnitude(sy[i])) * h;
        /* Covers the rounding of the leaves, whose exact planes are lost. */
        const float rounding = w4[i] * ROUNDING + (reach[i] * SLOPE_ROUNDING + 2 * h * SLOPE_STEP);
        error[i] = child_error[i] + terms->of_leaves * (w4[i] > 0 ? rounding : 0);
        all_planes &= node_is_plane(head[i]);
        all_something &= w4[i] > 0;
        any_something |= w4[i] > 0;
        gaps |= node_is_plane(head[i]) ? (w4[i] > 0 ? 0 : NODE_NOTHING) : tail[i] & NODE_NOTHING;
    }
    /* Least-squares plane through w at the four centres. */
    const uint32_t flag = (head[0] | head[1] | head[2] | head[3]) & 1u;
    const uint32_t merged_tail = plane_tail(((w4[1] - w4[0]) + (w4[3] - w4[2])) * (0.25f / h),
                                            ((w4[2] - w4[0]) + (w4[3] - w4[1])) * (0.25f / h));
    const uint32_t merged_head = plane_head(((w4[0] + w4[1]) + (w4[2] + w4[3])) * 0.25f, flag);
    const float w = plane_w(merged_head), slope_x = plane_slope_x(merged_tail),
                slope_y = plane_slope_y(merged_tail);
    float off[4], high[4], low[4];
    for (int i = 0; i < 4; i++) {
        const float side_x = i & 1 ? 1 : -1, side_y = i >> 1 ? 1 : -1;
        off[i] = magnitude(w + h * (slope_x * side_x + slope_y * side_y) - w4[i]) +
                 (h * (magnitude(slope_x - sx[i]) + magnitude(slope_y - sy[i])) + error[i]);
        /* The bound covers the planes below, too, as rays are tested against them. */
        high[i] = node_is_plane(head[i]) ? w4[i] + reach[i] + error[i] : float_from_bits(head[i]);
        /* A surface continues by up to a texel into a gap beside it. The slope of a surface seen edge-on is
         * unknown. */
        const float steepness = magnitude(sx[i]) + magnitude(sy[i]), beside = steepness > 0 ? steepness : NO_LIMIT;
        const float own_low = w4[i] - reach[i] - error[i] - (gaps ? beside : 0);
        low[i] = node_is_plane(head[i]) ? own_low : magnitude(float_from_bits(tail[i]));
        low[i] = w4[i] > 0 ? low[i] : NO_LIMIT; /* a gap */
    }
    const float w_max = w + 2 * h * (magnitude(slope_x) + magnitude(slope_y)) + terms->tolerance;
    const float worst = max_of_4(off) + ROUNDING * w_max;
    const int merges = all_planes & all_something & (worst <= tolerance_of(terms, w_max));
    const int is_plane = merges | (all_planes & !any_something);
    node[0] = is_plane ? merged_head : bits_of(max_of(max_of_4(high), 0));
    node[1] = is_plane ? merged_tail : bits_of(max_of(min_of_4(low), 0)) | gaps;
    *node_error = merges ? worst : 0;
}

/* Errors of the leaves: a row of zeros after the other errors. */
static const float *leaf_errors(const struct warp_layer *layer)
{
    return layer->errors + (warp_layer_nodes(layer) - layer->padded_width * layer->padded_height);
}

LANES_KERNEL static void merge_row(struct warp_layer *layer, uint32_t level, uint32_t y, struct span span)
{
    const uint32_t texels = layer->padded_width * layer->padded_height, across = layer->padded_width >> level;
    const size_t below = node_level_first(texels, level - 1) + (size_t)4 * across * y;
    const size_t here = node_level_first(texels, level) + (size_t)across * y;
    const float *child_errors = level == 1 ? leaf_errors(layer) : layer->errors + (below - texels);
    const struct merge_terms terms = {.h = 0.25f * (float)(1u << level),
                                      .tolerance = layer->tolerance,
                                      .nearness = layer->nearness,
                                      .of_leaves = level == 1,
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

/* Slopes depend on texels at distance one, and edges on slopes at distance one. */
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
        warp_find_slopes(layer, slopes_at(&scratch, first - 1), first - 1, slopes);
    warp_find_slopes(layer, slopes_at(&scratch, first), first, slopes);
    for (uint32_t y = first; y < end && y < layer->height; y++) {
        if (y + 1 < layer->height)
            warp_find_slopes(layer, slopes_at(&scratch, y + 1), y + 1, slopes);
        const struct slope_rows rows = {slopes_at(&scratch, y + 2), slopes_at(&scratch, y),
                                        slopes_at(&scratch, y + 1)};
        warp_make_leaves(layer, &rows, y, texels);
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
