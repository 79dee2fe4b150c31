/* SPDX-License-Identifier: MIT */
/* Makes a store's `voxels` from its `sums`: which are occupied, the images to search in each, and the empty
 * space (shaders/abuffer/voxels.comp, raster/reach.comp). */
#ifndef FARLIGHT_TRACE_ABUFFER_VOXELS_H
#define FARLIGHT_TRACE_ABUFFER_VOXELS_H

#include "base/error.h"
#include "trace/abuffer/store.h"
#include "trace/raster/reach.h"

#include <stdbool.h>
#include <stdint.h>

#define ABUFFER_BLOCK_VOXELS 4u /* along a side */

/* Number of items of each pass. */
uint32_t abuffer_voxel_blocks(const struct abuffer_store *store);
bool abuffer_voxels_reserve(struct abuffer_store *store, struct error *error);
/* Runs a pass over blocks first .. end - 1. All blocks of the passes before it must be complete. */
bool abuffer_voxels_pass(struct abuffer_store *store, unsigned pass, uint32_t first, uint32_t end,
                         struct error *error);

#endif
