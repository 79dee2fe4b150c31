/* SPDX-License-Identifier: MIT */
/* The leaves of a quadtree, row by row: a plane for each texel. */
#ifndef FARLIGHT_CLIENT_WARP_LEAVES_H
#define FARLIGHT_CLIENT_WARP_LEAVES_H

#include "warp/tree.h"

/* Slopes of the columns `left` to `right` of a row, as stored in nodes, and the words that hold them. */
struct slope_row {
    float *x, *y;
    uint32_t *tails;
};

/* A range of columns. */
struct span {
    int first, end;
};

/* Slopes of three rows; those of a missing row may be anything. */
struct slope_rows {
    const struct slope_row *above, *here, *below;
};

/* Finds the slopes of row y from w of the row and its neighbours. */
void warp_find_slopes(const struct warp_layer *layer, const struct slope_row *row, uint32_t y, struct span span);
/* Writes leaves of row y and their bits of `joined`; `rows` have slopes of one more column on both sides. */
void warp_make_leaves(struct warp_layer *layer, const struct slope_rows *rows, uint32_t y, struct span span);

#endif
