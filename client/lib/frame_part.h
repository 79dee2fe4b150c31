/* SPDX-License-Identifier: MIT */
/* A part of a frame as a frame of its own, such as one of several views. */
#ifndef FARLIGHT_CLIENT_LIB_FRAME_PART_H
#define FARLIGHT_CLIENT_LIB_FRAME_PART_H

#include "lib/farlight.h"

/* A rectangle in pixels from the frame's top left; `eye` is the offset of its eye from the frame's, along right
 * and up. */
struct fl_frame_part {
    uint32_t x, y, width, height;
    float eye[2];
};

/* Copies the description of a frame to one of another size, without pixels, times, comparisons, structure and
 * attachments, which stay `frame`'s. */
void fl_frame_alike(struct fl_frame *to, const struct fl_frame *frame, uint32_t width, uint32_t height);
/* A copy of a part of all layers of a decoded frame, without times, comparisons, structure and attachments. NULL:
 * there is no such part, or no memory. */
struct fl_frame *fl_frame_cut(const struct fl_frame *frame, const struct fl_frame_part *part,
                              struct fl_error *error);

#endif
