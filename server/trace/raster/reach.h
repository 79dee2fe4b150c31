/* SPDX-License-Identifier: MIT */
/* The empty space round the empty blocks of a grid (shaders/raster/layout.h, raster/reach.comp). */
#ifndef FARLIGHT_TRACE_RASTER_REACH_H
#define FARLIGHT_TRACE_RASTER_REACH_H

#include "base/error.h"
#include "gpu/buffer.h"

#include <stdbool.h>
#include <stdint.h>

#define RASTER_REACH_PASSES 3u /* passes along x, y and z, in this order */

struct raster_blocks {
    struct gpu_buffer *buffer;
    uint32_t first_texel, block_texels;
    uint32_t grid; /* blocks along a side */
};

/* Runs a pass over blocks first .. end - 1. All blocks of the passes before it must be complete. */
bool raster_reach_pass(struct gpu_device *device, const struct raster_blocks *blocks, unsigned pass,
                       uint32_t first, uint32_t end, struct error *error);

#endif
