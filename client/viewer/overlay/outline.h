/* SPDX-License-Identifier: MIT */
/* The outline of a chosen object, from a picture of identifiers. Independent of window and daemon. */
#ifndef FARLIGHT_VIEWER_OVERLAY_OUTLINE_H
#define FARLIGHT_VIEWER_OVERLAY_OUTLINE_H

#include "lib/farlight.h"

/* The number of a pixel of the layer `id` to compare. */
enum outline_by { OUTLINE_BY_NODE, OUTLINE_BY_MATERIAL };

/* The identifiers of a node and of all nodes below it, ascending, malloc'ed; NULL: out of memory. `nodes` are
 * as from fl_scene_objects. */
uint32_t *outline_family(const struct fl_object *nodes, size_t node_count, uint32_t node, size_t *count);
/* Marks pixels that show one of the objects, whose identifiers ascend, with 1, and others with 0. `pixels`:
 * four floats each, of the layer `id`. */
void outline_mark(const uint8_t *pixels, size_t pixel_count, enum outline_by by, const uint32_t *ids, size_t count,
                  uint8_t *marks);
/* Size of a picture of equally large views beside or above each other. */
struct outline_size {
    uint32_t width, height; /* size of the whole picture */
    uint32_t views_across, views_down;
};
/* Replaces the marks by their outline: unmarked pixels with a mark within `reach` pixels across and down, in
 * the same view. False: out of memory. */
bool outline_trace(uint8_t *marks, const struct outline_size *size, unsigned reach);
/* Draws marked pixels of a picture with 4 bytes a pixel. */
void outline_draw(const uint8_t *marks, size_t pixel_count, uint8_t *picture);

#endif
