/* SPDX-License-Identifier: MIT */
/* Rays through A-buffers: shaders/abuffer/traverse.glsl; paper, section 3.2. */
#ifndef FARLIGHT_TRACE_ABUFFER_TRACE_H
#define FARLIGHT_TRACE_ABUFFER_TRACE_H

#include "base/error.h"
#include "trace/abuffer/store.h"
#include "gpu_scene/scene.h"
#include "trace/tracer.h"
#include "trace/wave.h"

#include <stdbool.h>

/* Implement tracer_impl.trace_range and .surfaces; the scene's buffers are bound. A hit's distance is where the
 * ray meets the sample's plane, its surface the nearest point of the primitive that the sample is of. */
bool abuffer_intersect(struct abuffer_store *store, struct gpu_scene *scene, const struct ray_range *rays,
                       const struct tracer_options *options, struct error *error);
bool abuffer_surfaces(struct abuffer_store *store, const struct gpu_scene *scene, const struct ray_range *rays,
                      struct error *error);

#endif
