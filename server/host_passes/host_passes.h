/* SPDX-License-Identifier: MIT */
/* Second implementations of passes, on the host, for devices whose buffers are its own memory (software GL). Each
 * writes the same bytes as the shaders. A pass belongs here only while it makes a default picture or a view at
 * least 1.1 times as fast, or a whole picture by its own tracer 1.5 times.
 *
 * Compaction: teapot and helmet at 1280x720 on two cores, whitted, 16 samples: 1.10 and 1.15 times as fast as by
 * the passes; one sample with no program on the disk: 1.1. */
#ifndef FARLIGHT_HOST_PASSES_HOST_PASSES_H
#define FARLIGHT_HOST_PASSES_HOST_PASSES_H

#include "gpu/device.h"
#include "shared/hit.h"

/* Functions over the contents of buffers; places are counted from 0. */
struct host_passes {
    /* In place of render/hit_count.comp, compact_scan.comp and hit_list.comp: lists the rays that hit something,
     * and writes for each ray its place in that list, or HIT_PLACE_NONE. Returns the number of hits. */
    uint32_t (*list_hits)(const struct hit *hits, uint32_t ray_count, uint32_t *hit_list, uint32_t *hit_places);
    /* Replaces the sums of render/compact_count.comp and compact_scan.comp: counts the children and shadow rays
     * of the hits. */
    void (*count_children)(const uint32_t *child_counts, uint32_t hit_count, uint32_t *children,
                           uint32_t *shadow_rays);
    /* Replaces their scan: finds where the children of each block of COMPACT_BLOCK hits begin. `sorted`: where
     * those of each octant do, octant by octant. */
    void (*place_children)(const uint32_t *child_counts, uint32_t hit_count, bool sorted,
                           uint32_t (*block_offsets)[2]);
};

/* NULL: only the device's own passes are used. */
const struct host_passes *host_passes_of(const struct gpu_device *device);

#endif
