/* SPDX-License-Identifier: MIT */
/* H.264 to pixels, by libavcodec. */
#ifndef FARLIGHT_VIEWER_VIEW_DECODE_H
#define FARLIGHT_VIEWER_VIEW_DECODE_H

#include "viewer/overlay/pixmap.h"

struct decoder;

/* NULL with *error set: there is no decoder. */
struct decoder *decoder_create(struct fl_error *error);
/* One access unit. False: it cannot be decoded, and nothing after it before the next key frame. */
bool decoder_decode(struct decoder *decoder, const struct fl_frame *frame, struct pixmap *picture,
                    struct fl_error *error);
void decoder_destroy(struct decoder *decoder);

#endif
