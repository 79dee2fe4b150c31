/* SPDX-License-Identifier: MIT */
/* Tracing of pictures of another eye, tile by tile. */
#ifndef FARLIGHT_CLIENT_WARP_TRACE_H
#define FARLIGHT_CLIENT_WARP_TRACE_H

#include "warp/rays.h"
#include "warp/tree.h"
#include "warp/warp.h"

#define WARP_TILE 16u /* pixels along a side */

/* Parameters of all tiles. */
struct warp_task {
    const struct warp_layer *layers;
    uint32_t layer_count;
    struct warp_rays rays;
    float ranges[FL_WARP_LAYERS_MAX][2]; /* minimum and maximum w in each layer that a ray may hit */
    uint32_t width, height, stride;      /* size of the output, pixels */
    enum fl_warp_holes holes;
    /* Distance in texels, from a ray's last place before a surface, of the colour that fills a hole */
    float fill_back;
    uint32_t *colours;
    uint8_t *mask, *sticking; /* the latter may be NULL */
    bool sticks;              /* true if some layer has sticking; else it is not computed */
};

/* Sums over pixels. */
struct warp_tally {
    uint64_t by_mask[FL_WARP_OUTSIDE + 1], deeper, marched;
    uint64_t sticking; /* sum of 255 times the shares */
};

/* Adjacent pixels of a row. */
struct warp_pixels {
    uint32_t count;
    const uint32_t *colours, *mask;
    const uint8_t *sticking; /* valid where the mask says known; only read if a layer has sticking */
};

/* Writes the pixels within the picture, with a pattern over holes if requested. */
void warp_store(const struct warp_task *task, uint32_t x, uint32_t y, const struct warp_pixels *pixels,
                struct warp_tally *tally);

void warp_task_find_ranges(struct warp_task *task);
/* Traces a row of tiles and adds to the tally. */
void warp_trace_row(const struct warp_task *task, uint32_t row, struct warp_tally *tally);
void warp_iterate_row(const struct warp_task *task, uint32_t row, struct warp_tally *tally);

#endif
