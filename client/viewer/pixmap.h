/* SPDX-License-Identifier: MIT */
/* A picture that can be shown: opaque, 4 bytes a pixel, red first, rows from the top without gaps. */
#ifndef FARLIGHT_CLIENT_VIEWER_PIXMAP_H
#define FARLIGHT_CLIENT_VIEWER_PIXMAP_H

#include "lib/farlight.h"

struct pixmap {
    int width, height; /* 0: there is none */
    uint8_t *pixels;
    uint64_t version; /* another one whenever the pixels are */
};

/* Makes room for width by height pixels, whose values are then undefined. */
bool pixmap_resize(struct pixmap *picture, int width, int height, struct fl_error *error);
/* Takes a frame's pixels over; what is transparent lies over black. */
void pixmap_take(struct pixmap *picture, struct fl_frame *frame);
bool pixmap_copy(struct pixmap *to, const struct pixmap *from, struct fl_error *error);
void pixmap_finish(struct pixmap *picture);

#endif
