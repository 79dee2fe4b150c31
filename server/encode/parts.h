/* SPDX-License-Identifier: MIT */
/* Frames in parts, coarse first: what is encoded, cut where its beginning is a coarser answer, and put in order.
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

/* Those of a frame, in the order of its bytes; none: it comes as a whole. */
struct part_list {
    struct part parts[PARTS_MAX];
    uint32_t count;
};

/* Bytes of each kind, as encoded. */
struct parts_source {
    enum encoding encoding;
    const uint8_t *bytes[FRAME_PART_COUNT];
    size_t size_bytes[FRAME_PART_COUNT];
};

/* Copies all to `out` in the order in which they help most. Colours are cut if they are a JPEG in scans (struct
 * picture). */
void parts_arrange(const struct parts_source *source, uint8_t *out, struct part_list *list);

/* The end of the first part that ends at `at_bytes` or behind. */
size_t parts_end(const struct part_list *list, size_t at_bytes);
/* With fewer bytes a frame shows nothing: the end of its first colours and, where it has depth, of the first that
 * says something of it. */
size_t parts_needed_bytes(const struct part_list *list);

#endif
