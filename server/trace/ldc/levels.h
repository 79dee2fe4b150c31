/* SPDX-License-Identifier: MIT */
/* The empty space of a cube that rays skip: by the occupied cells of all three images together (ldc/cells.h); in
 * the paper's form, and where cells do not fit, by minimum and maximum depth over blocks of an image's texels (the
 * paper's two-level cube, section 1.3).
 *
 * Million reflected rays a second on two cores of software GL, a dragon of 47,000 triangles at a resolution of
 * 1024: blocks 0.15, cells 4.1. Image by image a ray visits 130 nodes and 54 texels, whose depths it meets but
 * whose planes it misses; by cells, for all images at once, it visits 16 nodes and blocks and 3 cells, and ends
 * with the first intersection. In return cells take 0.2 seconds to build, where blocks take 0.02; and 16 bytes for
 * each cell that a sample's plane passes, about two per sample. */
#ifndef FARLIGHT_TRACE_LDC_LEVELS_H
#define FARLIGHT_TRACE_LDC_LEVELS_H

#include "base/error.h"
#include "trace/ldc/cells.h"
#include "trace/ldc/store.h"
#include "trace/tracer.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Layout of the nodes over a cube in store.nodes. */
struct ldc_level_layout {
    bool cells;    /* they are nodes over cells of all three images: Cells of ldc/layout.h; else blocks, two floats
                      each, image after image, row after row */
    uint32_t grid; /* cells: nodes along a side */
    uint32_t row;  /* blocks: along a side of an image */
};
struct ldc_level_layout ldc_level_layout_of(const struct ldc_store *store, uint32_t resolution,
                                            const struct tracer_options *options);

/* Reserves nodes for cube `which` behind those of the cube before it, which stay, as do `kept` nodes of its
 * own. For functions that make nodes. */
bool ldc_levels_reserve(struct ldc_store *store, unsigned which, uint64_t node_count, uint64_t kept,
                        size_t node_bytes, struct error *error);

/* Nodes in the making; all-zero: none are. */
struct ldc_levels {
    struct ldc_store *store;
    const struct tracer_options *options;
    unsigned which, at; /* the last cube, and the current one */
    struct ldc_level_layout layout;
    struct ldc_cells cells;
};

/* Begins to write the nodes of cube `which` from its samples. Where there are more cells than the device takes
 * (from some twenty million samples on software GL), all cubes get blocks. Store and options must stay until
 * they are complete. */
void ldc_levels_begin(struct ldc_levels *levels, struct ldc_store *store, unsigned which,
                      const struct tracer_options *options);
/* Runs a unit. Queues the work; some units read counts back. */
enum tracer_progress ldc_levels_step(struct ldc_levels *levels, struct error *error);
void ldc_levels_finish(struct ldc_levels *levels);          /* drops the nodes in the making */
uint64_t ldc_levels_bytes(const struct ldc_levels *levels); /* device memory besides the store */

#endif
