/* SPDX-License-Identifier: MIT */
/* Pictures of another eye, tile by tile. */
#ifndef FARLIGHT_CLIENT_WARP_TRACE_H
#define FARLIGHT_CLIENT_WARP_TRACE_H

#include "warp/rays.h"
#include "warp/tree.h"
#include "warp/warp.h"

#define WARP_TILE 16u /* pixels along a side */

/* What is the same for all tiles. */
struct warp_task {
    const struct warp_layer *layers;
    uint32_t layer_count;
    struct warp_rays rays;
    float ranges[FL_WARP_LAYERS_MAX][2]; /* least and greatest w of each layer that a ray may meet */
    uint32_t width, height, stride;      /* of what is written, pixels */
    enum fl_warp_holes holes;
    float fill_back; /* texels from where a ray was last before a surface to what it is filled with */
    uint32_t *colours;
    uint8_t *mask, *sticking; /* the latter may be NULL */
    bool sticks;              /* something, in some layer; else what sticks is not asked for */
};

/* Pixels. */
struct warp_tally {
    uint64_t by_mask[FL_WARP_OUTSIDE + 1], deeper, walked;
    uint64_t sticking; /* sum of 255 times their shares */
};

/* Side by side in a row. */
struct warp_pixels {
    uint32_t count;
    const uint32_t *colours, *mask;
    const uint8_t *sticking; /* counts where the mask says known; only read if something sticks */
};

/* Writes those that are in the picture, under a pattern where that is wanted. */
void warp_store(const struct warp_task *task, uint32_t x, uint32_t y, const struct warp_pixels *pixels,
                struct warp_tally *tally);

void warp_task_find_ranges(struct warp_task *task);
/* A row of tiles; adds to the tally. */
void warp_trace_row(const struct warp_task *task, uint32_t row, struct warp_tally *tally);
void warp_iterate_row(const struct warp_task *task, uint32_t row, struct warp_tally *tally);

#endif
