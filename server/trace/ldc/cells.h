/* SPDX-License-Identifier: MIT */
/* The cells of a cube that samples' planes pass: a ray in all three images at once skips empty space and finds
 * samples by them. Cells of ldc/layout.h, made by shaders/ldc/cells.comp and raster/reach.comp. */
#ifndef FARLIGHT_TRACE_LDC_CELLS_H
#define FARLIGHT_TRACE_LDC_CELLS_H

#include "base/error.h"
#include "trace/ldc/store.h"
#include "trace/step.h"

#include <stdbool.h>
#include <stdint.h>

struct ldc_cells;
/* Does a unit of the work and says in cells->next what comes after it. */
typedef bool ldc_cells_unit(struct ldc_cells *cells, struct error *error);

/* counts of ldc/cells.comp */
struct ldc_cell_counts {
    uint32_t lower_nodes[4], upper_nodes[4], unused[8];
    uint32_t blocks, entries, further, padding;
};

/* What is being made; all-zero: nothing. */
struct ldc_cells {
    struct ldc_store *store;
    unsigned which;
    uint32_t grid;         /* nodes along a side */
    ldc_cells_unit *next;  /* NULL: it is done */
    unsigned reach_passes; /* that are done */
    struct gpu_buffer list, counter;
    struct ldc_cell_counts counts;
};

/* Begins to write nodes, blocks and entries of cube `which`, whose samples are there, and where in it cells hold
 * something. `grid` is the number of nodes along a side. The store must stay until it is done. */
void ldc_cells_begin(struct ldc_cells *cells, struct ldc_store *store, unsigned which, uint32_t grid);
/* A pass of it. Queues the work; two of them read counts back. */
enum tracer_progress ldc_cells_go_on(struct ldc_cells *cells, struct error *error);
/* Lets go of it, done or not. */
void ldc_cells_finish(struct ldc_cells *cells);

#endif
