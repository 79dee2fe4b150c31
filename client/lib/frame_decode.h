/* SPDX-License-Identifier: MIT */
/* What has come of a frame, decoded and checked. No I/O. */
#ifndef FARLIGHT_CLIENT_LIB_FRAME_DECODE_H
#define FARLIGHT_CLIENT_LIB_FRAME_DECODE_H

#include "lib/parts.h"

/* Where the bytes of each kind begin. */
struct fl_encoded {
    const uint8_t *colours, *depth, *normals, *coarse_depth, *sticking;
    struct fl_parts_bytes come, all;
};

/* Fills pixels, which have their memory already and are none for H.264, and attachments. */
bool fl_frame_decode(struct fl_frame *frame, const struct fl_encoded *encoded, struct fl_error *error);

#endif
