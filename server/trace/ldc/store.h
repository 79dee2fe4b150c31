/* SPDX-License-Identifier: MIT */
/* Layered depth cubes on the device: the buffers of ldc/layout.h and the place of each cube in them. GL thread.
 * Bürger, Hertel, Krüger, Westermann. GPU Rendering of Secondary Effects. 2007, sections 1.2 and 1.3. */
#ifndef FARLIGHT_TRACE_LDC_STORE_H
#define FARLIGHT_TRACE_LDC_STORE_H

#include "base/error.h"
#include "gpu/buffer.h"
#include "gpu/device.h"
#include "trace/structure.h"

#include <stdbool.h>
#include <stdint.h>

enum { LDC_CUBE_STATIC, LDC_CUBE_DYNAMIC, LDC_CUBES_MAX };

/* Place of a cube in the world, and of its parts in the buffers. */
struct ldc_cube {
    float lower_world[3];
    float cell_world;           /* metres */
    uint32_t resolution;        /* texels along a side of each of the three images; 0: there is no cube */
    uint32_t resolution_wanted; /* requested resolution, where it was lowered to limit the samples; 0: it was
                                   not lowered */
    uint32_t first_texel, first_sample, sample_count, first_quad, quad_count;
    /* levels.c: nodes, entries of cells, and bounds of the occupied cells */
    uint32_t first_node, node_count, first_entry, entry_count;
    uint32_t lower_cells[3], upper_cells[3];
    uint32_t layers_needed, layers_kept;
    uint64_t samples_lost;
};

struct ldc_store {
    struct gpu_device *device;
    struct gpu_buffer texels, quads, geometry, surface, primitives, nodes, entries;
    bool no_cells;                        /* levels.c: there were too many, the cube has ranges instead */
    struct ldc_cube cubes[LDC_CUBES_MAX]; /* the static one first: the dynamic one lies behind it */
};

void ldc_store_init(struct ldc_store *store, struct gpu_device *device);
void ldc_store_finish(struct ldc_store *store); /* leaves it empty */
uint64_t ldc_store_bytes(const struct ldc_store *store);
/* Adds the rows of a cube; none if its resolution is 0. */
void ldc_cube_report(const struct ldc_store *store, unsigned which, bool built, struct structure_rows *rows);
/* Enlarges the buffer to size_bytes and keeps its first kept_bytes. On failure all of it stays. */
bool ldc_store_grow(struct gpu_device *device, struct gpu_buffer *buffer, uint64_t kept_bytes, uint64_t size_bytes,
                    struct error *error);

#endif
