/* SPDX-License-Identifier: MIT */
/* Estimates the texels that drawing along the axes fills: a wall of two triangles takes longer than a statue of
 * ten thousand.
 */
#ifndef FARLIGHT_TRACE_RASTER_COVER_H
#define FARLIGHT_TRACE_RASTER_COVER_H

#include "trace/raster/draw.h"
#include "gpu_scene/scene.h"

#include <stdint.h>

/* Where primitives first .. end - 1, of which there are some, cover more than `maximum` texels of the three images
 * together: the end of those that do not, at least one. *texels: what they cover, about; of meshes that deform, as
 * if they did not. */
uint32_t axes_cover_end(const struct axes_draw *draw, const struct gpu_scene *scene, float cell_world,
                        uint32_t first, uint32_t end, double maximum, double *texels);

#endif
