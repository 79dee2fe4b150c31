/* SPDX-License-Identifier: MIT */
/* The leaves of a quadtree, row by row: a plane for each texel. */
#ifndef FARLIGHT_CLIENT_WARP_LEAVES_H
#define FARLIGHT_CLIENT_WARP_LEAVES_H

#include "warp/tree.h"

/* Of a row, `left` to `right`: slopes as they are in nodes, and the words that hold them. */
struct slope_row {
    float *x, *y;
    uint32_t *tails;
};

/* Columns of a row. */
struct span {
    int first, end;
};

/* Slopes of three rows. Those of a row that is not there are not read for what they are. */
struct slope_rows {
    const struct slope_row *above, *here, *below;
};

/* Of row y, from w of it and of its neighbours. */
void warp_find_slopes(const struct warp_layer *layer, const struct slope_row *row, uint32_t y, struct span span);
/* Writes leaves of row y and what they are joined to; `rows` have the slopes of one column more on both sides. */
void warp_make_leaves(struct warp_layer *layer, const struct slope_rows *rows, uint32_t y, struct span span);

#endif
