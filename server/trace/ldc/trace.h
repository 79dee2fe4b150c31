/* SPDX-License-Identifier: MIT */
/* A wave through the cubes (paper, section 1.4): shaders/ldc/traverse.glsl. */
#ifndef FARLIGHT_TRACE_LDC_TRACE_H
#define FARLIGHT_TRACE_LDC_TRACE_H

#include "base/error.h"
#include "trace/ldc/store.h"
#include "gpu_scene/scene.h"
#include "trace/tracer.h"
#include "trace/wave.h"

#include <stdbool.h>

/* Finds closest hits: intersections whose `instance` is HIT_NO_PRIMITIVE - 1 for a sample, with its number in
 * `primitive`, and HIT_NO_PRIMITIVE for a disc; ldc_surfaces() makes hits of them. For any hits:
 * transmittances. Cubes with resolution 0 are skipped. */
bool ldc_intersect(struct ldc_store *store, struct gpu_scene *scene, const struct ray_range *rays,
                   const struct tracer_options *options, struct error *error);

#endif
