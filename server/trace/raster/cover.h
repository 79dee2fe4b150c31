/* SPDX-License-Identifier: MIT */
/* Estimates the texels that drawing along the axes fills: a wall of two triangles takes longer than a statue of
 * ten thousand.
 */
#ifndef FARLIGHT_TRACE_RASTER_COVER_H
#define FARLIGHT_TRACE_RASTER_COVER_H

#include "trace/raster/draw.h"
#include "gpu_scene/scene.h"

#include <stdint.h>

/* Finds the first primitive of first .. end - 1 (at least one) with which more than `maximum` texels of the
 * three images together are covered. Returns the end of those before, at least one. *texels: an estimate of
 * their texels; deforming meshes count at rest. */
uint32_t axes_cover_end(const struct axes_draw *draw, const struct gpu_scene *scene, float cell_world,
                        uint32_t first, uint32_t end, double maximum, double *texels);

#endif
