/* SPDX-License-Identifier: MIT */
/* Decoding of H.264 with libavcodec. */
#ifndef FARLIGHT_VIEWER_VIEW_DECODE_H
#define FARLIGHT_VIEWER_VIEW_DECODE_H

#include "viewer/overlay/pixmap.h"

struct decoder;

/* Creates a decoder. NULL with *error set: there is none. */
struct decoder *decoder_create(struct fl_error *error);
/* Decodes an access unit. False: it is undecodable, and so are all units before the next key frame. */
bool decoder_decode(struct decoder *decoder, const struct fl_frame *frame, struct pixmap *picture,
                    struct fl_error *error);
void decoder_destroy(struct decoder *decoder);

#endif
