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

/* What tracer_impl.trace does. Buffers of the scene are bound. A hit's distance is that of the ray's crossing, its
 * surface that of the sample's own primitive at the place nearest to the crossing. */
bool abuffer_trace(struct abuffer_store *store, struct gpu_scene *scene, const struct wave *wave,
                   const struct tracer_options *options, struct error *error);

#endif
