/* SPDX-License-Identifier: MIT */
/* A frame that comes in as frame_begin, frame_data and frame_end. */
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

/* False: the sender breaks the protocol: a frame has begun already, is encoded, or has another number of bytes
 * than its size, format and layers say. With `keep`, `pixels` is NULL afterwards only where there is no memory. */
bool incoming_begin(struct incoming *incoming, const struct message_frame_begin *begin, bool keep);
/* False: not the next bytes of a frame that has begun, or more than it has. */
bool incoming_take(struct incoming *incoming, const struct message_frame_data *data);
bool incoming_is_whole(const struct incoming *incoming);
/* Makes it zero. */
void incoming_finish(struct incoming *incoming);

#endif
