/* SPDX-License-Identifier: MIT */
/* The cube of cells round the instances whose images along the axes are drawn. */
#ifndef FARLIGHT_TRACE_RASTER_BOX_H
#define FARLIGHT_TRACE_RASTER_BOX_H

#include "base/error.h"
#include "gpu_scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

/* A box of cubic cells. It begins at the lower corner of the instances' bounds, less a cell, and is as long on
 * every side as they are on the longest. It moves with them and keeps its cells, so a body that only moves is
 * sampled at the same places. cell_world, metres, is 0 if there are no instances. */
struct axes_box {
    float lower_world[3], cell_world;
};

/* Places the box; `resolution` is the number of cells along a side. Fails where squares of distances would
 * overflow. */
bool axes_box_place(struct axes_box *box, const struct gpu_scene *scene, const uint32_t *instances, uint32_t count,
                    uint32_t resolution, struct error *error);
/* The box of `resolution` cells along a side as one cell. */
struct axes_box axes_box_whole(const struct axes_box *box, uint32_t resolution);

#endif
