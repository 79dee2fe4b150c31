/* SPDX-License-Identifier: MIT */
/* Cells of a cube that the planes of samples pass. By them a ray skips empty space and finds samples in all
 * three images at once. Layout: Cells in ldc/layout.h; made by shaders/ldc/cells.comp and raster/reach.comp. */
#ifndef FARLIGHT_TRACE_LDC_CELLS_H
#define FARLIGHT_TRACE_LDC_CELLS_H

#include "base/error.h"
#include "trace/ldc/store.h"
#include "trace/step.h"

#include <stdbool.h>
#include <stdint.h>

struct ldc_cells;
/* Runs a unit of the work and sets cells->next to the one after it. */
typedef bool ldc_cells_unit(struct ldc_cells *cells, struct error *error);

/* Counts that ldc/cells.comp writes. */
struct ldc_cell_counts {
    uint32_t lower_nodes[4], upper_nodes[4], unused[8];
    uint32_t blocks, entries, further, padding;
};

/* Cells in the making; all-zero: none are. */
struct ldc_cells {
    struct ldc_store *store;
    unsigned which;
    uint32_t grid;         /* nodes along a side */
    ldc_cells_unit *next;  /* NULL: the cells are complete */
    unsigned reach_passes; /* passes of reach.c that are complete */
    struct gpu_buffer list, counter;
    struct ldc_cell_counts counts;
};

/* Begins to write nodes, blocks and entries of cube `which` from its samples, and the bounds of its occupied
 * cells. `grid` is the number of nodes along a side. The store must stay until they are complete. */
void ldc_cells_begin(struct ldc_cells *cells, struct ldc_store *store, unsigned which, uint32_t grid);
/* Runs a unit. Queues the work; two of the units read counts back. */
enum tracer_progress ldc_cells_step(struct ldc_cells *cells, struct error *error);
/* Drops the cells, complete or not. */
void ldc_cells_finish(struct ldc_cells *cells);

#endif
