/* SPDX-License-Identifier: MIT */
/* A picture for display: opaque, 4 bytes per pixel, red first, rows from the top without gaps. */
#ifndef FARLIGHT_VIEWER_OVERLAY_PIXMAP_H
#define FARLIGHT_VIEWER_OVERLAY_PIXMAP_H

#include "lib/farlight.h"

struct pixmap {
    int width, height; /* 0: none */
    uint8_t *pixels;
    uint64_t version; /* changes with the pixels */
};

/* Allocates width by height pixels with undefined values. */
bool pixmap_resize(struct pixmap *picture, int width, int height, struct fl_error *error);
/* Copies a frame's pixels; transparent ones are composited over black. */
void pixmap_take(struct pixmap *picture, struct fl_frame *frame);
bool pixmap_copy(struct pixmap *to, const struct pixmap *from, struct fl_error *error);
/* Copies the picture without a margin of this many pixels on each side. */
bool pixmap_crop(struct pixmap *to, const struct pixmap *from, int margin_x, int margin_y, struct fl_error *error);
void pixmap_exchange(struct pixmap *a, struct pixmap *b); /* both get new versions */
void pixmap_finish(struct pixmap *picture);

#endif
