/* SPDX-License-Identifier: MIT */
/* What a sample holds of its surface, put into hits. */
#ifndef FARLIGHT_TRACE_LDC_SURFACE_H
#define FARLIGHT_TRACE_LDC_SURFACE_H

#include "base/error.h"
#include "trace/ldc/store.h"
#include "gpu_scene/scene.h"
#include "trace/wave.h"

#include <stdbool.h>

/* From crossings as ldc_trace.h has them to hits, in place: what trace_surfaces() is to exact tracers. The scene's
 * buffers are bound already. Nothing to do for any-hit waves and those that want crossings only. Queues the work.
 */
bool ldc_surfaces(struct ldc_store *store, const struct gpu_scene *scene, const struct wave *wave,
                  struct error *error);

#endif
