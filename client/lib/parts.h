/* SPDX-License-Identifier: MIT */
/* The order in which a frame's bytes come: as a whole, colours, depth and normals one behind the other, or in
 * parts. No I/O. */
#ifndef FARLIGHT_CLIENT_LIB_PARTS_H
#define FARLIGHT_CLIENT_LIB_PARTS_H

#include "lib/farlight.h"

#define FL_PARTS_MAX 8u

struct fl_parts_bytes {
    uint64_t of[PROTOCOL_FRAME_PART_COUNT];
};

struct fl_parts {
    struct record_frame_part parts[FL_PARTS_MAX];
    uint32_t count;
    struct fl_parts_bytes bytes; /* of all */
    bool told;                   /* by the daemon: it is a frame in parts */
    uint32_t come;               /* so many are whole */
    uint64_t come_bytes;         /* of the next one */
};

void fl_parts_init(struct fl_parts *parts, const struct message_frame_begin *begin);
/* Before any bytes; false: the frame of `begin` cannot have those. */
bool fl_parts_tell(struct fl_parts *parts, const struct message_frame_begin *begin,
                   const struct message_frame_parts *told, struct fl_error *error);
/* Puts bytes that come next to where they belong: the kinds one behind the other, in the order of their numbers.
 * There are no more bytes than the frame has. */
void fl_parts_put(struct fl_parts *parts, uint8_t *to, const uint8_t *bytes, size_t count);
/* In whole parts. */
struct fl_parts_bytes fl_parts_come(const struct fl_parts *parts);
/* All that will come. */
uint64_t fl_parts_sum(const struct fl_parts *parts);
/* What has come is an answer: colours, and depth if there is any. */
bool fl_parts_are_enough(const struct fl_parts *parts);

#endif
