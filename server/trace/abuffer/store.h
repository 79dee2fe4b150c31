/* SPDX-License-Identifier: MIT */
/* The structure of the tracer `abuffer` on the device (shaders/abuffer/layout.h). build.c fills it, voxels.c
 * its voxels; trace.c reads it. */
#ifndef FARLIGHT_TRACE_ABUFFER_STORE_H
#define FARLIGHT_TRACE_ABUFFER_STORE_H

#include "gpu/buffer.h"

#include <stdbool.h>
#include <stdint.h>

struct abuffer_store {
    struct gpu_device *device;
    float lower_world[3];
    float cell_world;
    uint32_t resolution;        /* N; 0: the scene holds nothing that could be drawn */
    uint32_t resolution_wanted; /* greater than `resolution` where that one would have had too many samples */
    uint32_t voxels_along;      /* V */
    bool without_steep;         /* no image has samples that are steep in it: lets searches skip by planes */
    bool whole_voxels;          /* voxels do not know their occupied parts: searches step voxel by voxel */
    uint64_t sample_count;
    uint32_t depth_max; /* maximum of samples in a texel */
    uint32_t drawn_count;
    struct gpu_buffer texels, samples, ids, drawn, voxels, subvoxels;
    struct gpu_buffer sums; /* sums over the last build's fragments */
};

void abuffer_store_init(struct abuffer_store *store, struct gpu_device *device);
void abuffer_store_finish(struct abuffer_store *store);        /* leaves it empty */
bool abuffer_has_subvoxels(const struct abuffer_store *store); /* false: all voxels share the same ones */
uint64_t abuffer_store_bytes(const struct abuffer_store *store);

#endif
