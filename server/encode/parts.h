/* SPDX-License-Identifier: MIT */
/* Frames in parts, coarse first: encoded data is cut where its beginning is a coarser answer, and put in order.
 * Any thread. */
#ifndef FARLIGHT_ENCODE_PARTS_H
#define FARLIGHT_ENCODE_PARTS_H

#include "base/words.h"

#include <stddef.h>
#include <stdint.h>

#define PARTS_MAX 8u

struct part {
    enum frame_part_kind kind;
    size_t bytes;
};

/* Parts of a frame, in the order of its bytes; none: it is sent whole. */
struct part_list {
    struct part parts[PARTS_MAX];
    uint32_t count;
};

/* Encoded bytes of each kind. */
struct parts_source {
    enum encoding encoding;
    const uint8_t *bytes[FRAME_PART_COUNT];
    size_t size_bytes[FRAME_PART_COUNT];
};

/* Copies everything to `out` in the order of usefulness. Colours are cut if they are a JPEG in scans (struct
 * picture). */
void parts_arrange(const struct parts_source *source, uint8_t *out, struct part_list *list);

/* End of the first part that ends at or after `at_bytes`. */
size_t parts_end(const struct part_list *list, size_t at_bytes);
/* Minimum of bytes with which a frame shows something: the end of its first colours and, if it has depth, of
 * the first part with depth. */
size_t parts_needed_bytes(const struct part_list *list);

#endif
