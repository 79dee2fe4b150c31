/* SPDX-License-Identifier: MIT */
/* A frame that arrives as frame_begin, frame_data and frame_end. */
#ifndef FARLIGHT_CLIENT_HELPER_INCOMING_H
#define FARLIGHT_CLIENT_HELPER_INCOMING_H

#include "protocol/messages.h"

/* Zero: no frame. */
struct incoming {
    bool begun;
    struct message_frame_begin begin;
    uint8_t *pixels; /* malloc'ed; NULL: the frame is only counted */
    uint64_t received_bytes;
};

/* False: the sender breaks the protocol: a frame has begun already, is encoded, or its number of bytes contradicts
 * its size, format and layers. With `keep`, `pixels` is then NULL only if there is no memory. */
bool incoming_begin(struct incoming *incoming, const struct message_frame_begin *begin, bool keep);
/* False: these are not the next bytes of the current frame, or exceed it. */
bool incoming_take(struct incoming *incoming, const struct message_frame_data *data);
bool incoming_is_whole(const struct incoming *incoming);
/* Makes it zero. */
void incoming_finish(struct incoming *incoming);

#endif
