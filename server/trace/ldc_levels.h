/* SPDX-License-Identifier: MIT */
/* What of a cube's images can be skipped: least and greatest depth over blocks of texels (the paper's two-level
 * cube, section 1.3), or over all sizes of blocks, a pyramid. */
#ifndef FARLIGHT_TRACE_LDC_LEVELS_H
#define FARLIGHT_TRACE_LDC_LEVELS_H

#include "base/error.h"
#include "trace/ldc_store.h"
#include "trace/tracer.h"

#include <stdbool.h>

/* Writes the nodes of cube `which`, whose samples are there. */
bool ldc_levels_build(struct ldc_store *store, unsigned which, const struct tracer_options *options,
                      struct error *error);

#endif
