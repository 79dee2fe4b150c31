/* SPDX-License-Identifier: MIT */
/* The order of a frame's bytes on the wire: the whole frame with colours, depth and normals in sequence, or
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
    struct fl_parts_bytes bytes; /* sizes of all parts together */
    bool in_parts;               /* true for a frame in parts, which the daemon announced */
    uint32_t come;               /* number of complete parts */
    uint64_t come_bytes;         /* received bytes of the next part */
};

void fl_parts_init(struct fl_parts *parts, const struct message_frame_begin *begin);
/* Sets the parts that the daemon announced, before any bytes arrive. False: a frame with this `begin` cannot
 * have them. */
bool fl_parts_set(struct fl_parts *parts, const struct message_frame_begin *begin,
                  const struct message_frame_parts *announced, struct fl_error *error);
/* Stores the next bytes: kinds follow each other in memory, in the order of their numbers. The caller passes no
 * more bytes than the frame has. */
void fl_parts_put(struct fl_parts *parts, uint8_t *to, const uint8_t *bytes, size_t count);
/* Bytes in complete parts, by kind. */
struct fl_parts_bytes fl_parts_received(const struct fl_parts *parts);
/* Bytes of all parts. */
uint64_t fl_parts_sum(const struct fl_parts *parts);
/* True if the complete parts show something: colours, and depth if the frame has any. */
bool fl_parts_are_enough(const struct fl_parts *parts);

#endif
