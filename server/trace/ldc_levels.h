/* SPDX-License-Identifier: MIT */
/* What of a cube's images can be skipped: least and greatest depth over blocks of texels (the paper's two-level
 * cube, section 1.3), or over all sizes of blocks, a pyramid. */
#ifndef FARLIGHT_TRACE_LDC_LEVELS_H
#define FARLIGHT_TRACE_LDC_LEVELS_H

#include "base/error.h"
#include "trace/ldc_store.h"
#include "trace/tracer.h"

#include <stdbool.h>
#include <stdint.h>

/* How the nodes over an image lie in store.nodes: two floats each, level after level from the top, image after
 * image. A node of level l covers 2^(bits l) texels along a side; level 0 are the texels themselves. */
struct ldc_level_layout {
    uint32_t bits;        /* log2 of the children along a side of a node */
    uint32_t top;         /* the highest level */
    uint32_t row;         /* blocks: nodes in a row; of a pyramid each level has 2^(bits (top - l)) */
    uint32_t image_nodes; /* of one of the three */
    bool blocks;          /* one level, not a pyramid up to a single node */
    bool cells;           /* none of this, but nodes over cells of all three images: LDC_NODE_* of shared/ldc.h */
    uint32_t grid;        /* cells: nodes along a side */
};
struct ldc_level_layout ldc_level_layout_of(uint32_t resolution, const struct tracer_options *options);

/* Writes the nodes of cube `which`, whose samples are there. */
bool ldc_levels_build(struct ldc_store *store, unsigned which, const struct tracer_options *options,
                      struct error *error);

#endif
