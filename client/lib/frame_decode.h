/* SPDX-License-Identifier: MIT */
/* Decoding and checking of the received parts of a frame. No I/O. */
#ifndef FARLIGHT_CLIENT_LIB_FRAME_DECODE_H
#define FARLIGHT_CLIENT_LIB_FRAME_DECODE_H

#include "lib/parts.h"

/* The encoded bytes by kind, and how many of them have arrived. */
struct fl_encoded {
    const uint8_t *colours, *depth, *normals, *coarse_depth, *sticking;
    struct fl_parts_bytes come, all;
};

/* Fills attachments and pixels. Memory for pixels is allocated already, except in H.264, where there are none. */
bool fl_frame_decode(struct fl_frame *frame, const struct fl_encoded *encoded, struct fl_error *error);

#endif
