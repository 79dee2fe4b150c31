/* SPDX-License-Identifier: MIT */
/* Places the cube of cells round instances. */
#include "trace/raster/box.h"

#include <math.h>

/* Maximum coordinate: squares of the lengths in a larger box, which traversals compute, would overflow a float. */
#define PLACE_MAX 1e18
/* Minimum of a cell relative to a coordinate: neighbours of a smaller one would have equal positions, which
 * are floats. */
#define CELL_RELATIVE_MIN 0x1p-22
#define CELL_MIN 1e-12 /* metres; keeps squares of cells well above zero, too */
#define MARGIN_CELLS 1

struct bounds {
    double lower[3], upper[3];
};

static struct bounds bounds_of(const struct gpu_scene *scene, const uint32_t *instances, uint32_t count)
{
    struct bounds bounds = {{0}, {0}};
    for (uint32_t i = 0; i < count; i++) {
        float lower[3], upper[3];
        gpu_scene_instance_bounds(scene, instances[i], lower, upper);
        for (int k = 0; k < 3; k++) {
            bounds.lower[k] = i > 0 ? fmin(bounds.lower[k], (double)lower[k]) : (double)lower[k];
            bounds.upper[k] = i > 0 ? fmax(bounds.upper[k], (double)upper[k]) : (double)upper[k];
        }
    }
    return bounds;
}

bool axes_box_place(struct axes_box *box, const struct gpu_scene *scene, const uint32_t *instances, uint32_t count,
                    uint32_t resolution, struct error *error)
{
    *box = (struct axes_box){0};
    if (count == 0)
        return true;
    struct bounds bounds = bounds_of(scene, instances, count);
    double longest = 0, farthest = 0;
    for (int k = 0; k < 3; k++) {
        if (!(bounds.lower[k] >= -PLACE_MAX && bounds.upper[k] <= PLACE_MAX))
            return error_set(error, ERROR_LIMIT, "scene",
                             "structures of samples hold a scene up to %g metres from its origin", PLACE_MAX);
        longest = fmax(longest, bounds.upper[k] - bounds.lower[k]);
        farthest = fmax(farthest, fmax(fabs(bounds.lower[k]), fabs(bounds.upper[k])));
    }
    double cell = fmax(longest / (resolution - 2 * MARGIN_CELLS), fmax(CELL_RELATIVE_MIN * farthest, CELL_MIN));
    box->cell_world = (float)cell;
    for (int k = 0; k < 3; k++)
        box->lower_world[k] = (float)(bounds.lower[k] - MARGIN_CELLS * cell);
    return true;
}

struct axes_box axes_box_whole(const struct axes_box *box, uint32_t resolution)
{
    struct axes_box whole = *box;
    whole.cell_world *= (float)resolution;
    return whole;
}
