/* SPDX-License-Identifier: MIT */
/* Which cells of a cube samples' planes pass: what a ray that looks at all three images at once skips by, and what
 * it finds samples by. LDC_NODE_* of shared/ldc.h, made by shaders/ldc/cells.comp. */
#ifndef FARLIGHT_TRACE_LDC_CELLS_H
#define FARLIGHT_TRACE_LDC_CELLS_H

#include "base/error.h"
#include "trace/ldc_store.h"

#include <stdbool.h>
#include <stdint.h>

/* Writes nodes, blocks and entries of cube `which`, whose samples are there, and where in it cells hold something.
 * `grid` is the number of nodes along a side. Queues the work; reads two counts back. */
bool ldc_cells_build(struct ldc_store *store, unsigned which, uint32_t grid, struct error *error);

#endif
