/* SPDX-License-Identifier: MIT */
/* A line around what is chosen, from a picture of identifiers. Independent of window and daemon. */
#ifndef FARLIGHT_VIEWER_OVERLAY_OUTLINE_H
#define FARLIGHT_VIEWER_OVERLAY_OUTLINE_H

#include "lib/farlight.h"

/* The number of a pixel of the layer `id` that is compared. */
enum outline_by { OUTLINE_BY_NODE, OUTLINE_BY_MATERIAL };

/* The identifiers of a node and of all nodes below it, ascending, malloc'ed; NULL: out of memory. `nodes` as of
 * fl_scene_objects. */
uint32_t *outline_family(const struct fl_object *nodes, size_t node_count, uint32_t node, size_t *count);
/* Marks with 1 what shows one of the objects, whose identifiers ascend, and all else with 0. `pixels`: four floats
 * each, of the layer `id`. */
void outline_mark(const uint8_t *pixels, size_t pixel_count, enum outline_by by, const uint32_t *ids, size_t count,
                  uint8_t *marks);
/* Pixels of a picture of views beside or above one another, each as large as the others. */
struct outline_size {
    uint32_t width, height; /* of all together */
    uint32_t views_across, views_down;
};
/* Leaves marked the pixels that are not, but have one within so many pixels across and down, in the same view.
 * False: out of memory. */
bool outline_trace(uint8_t *marks, const struct outline_size *size, unsigned reach);
/* Draws marked pixels of a picture of 4 bytes a pixel. */
void outline_draw(const uint8_t *marks, size_t pixel_count, uint8_t *picture);

#endif
