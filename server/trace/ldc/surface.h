/* SPDX-License-Identifier: MIT */
/* Copies the surface words of samples into hits. */
#ifndef FARLIGHT_TRACE_LDC_SURFACE_H
#define FARLIGHT_TRACE_LDC_SURFACE_H

#include "base/error.h"
#include "trace/ldc/store.h"
#include "gpu_scene/scene.h"
#include "trace/wave.h"

#include <stdbool.h>

/* Turns intersections of ldc_intersect() into hits, in place: the counterpart of trace_surfaces() for exact
 * tracers. The scene's buffers are bound already. Queues the work. */
bool ldc_surfaces(struct ldc_store *store, const struct gpu_scene *scene, const struct ray_range *rays,
                  struct error *error);

#endif
