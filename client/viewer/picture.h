/* SPDX-License-Identifier: MIT */
/* A picture that can be shown: opaque, 4 bytes a pixel, red first, rows from the top without gaps. */
#ifndef FARLIGHT_CLIENT_VIEWER_PICTURE_H
#define FARLIGHT_CLIENT_VIEWER_PICTURE_H

#include "lib/farlight.h"

struct picture {
    int width, height; /* 0: there is none */
    uint8_t *pixels;
    uint64_t version; /* another one whenever the pixels are */
};

/* Makes room for width by height pixels, whose values are then undefined. */
bool picture_resize(struct picture *picture, int width, int height, struct fl_error *error);
/* Takes a frame's pixels over; what is transparent lies over black. */
void picture_take(struct picture *picture, struct fl_frame *frame);
bool picture_copy(struct picture *to, const struct picture *from, struct fl_error *error);
void picture_finish(struct picture *picture);

#endif
