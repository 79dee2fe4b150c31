/* SPDX-License-Identifier: MIT */
/* Makes a sparse voxel octree of a scene (svo/svo.h). */
#ifndef FARLIGHT_TESTS_BENCH_SVO_BUILD_H
#define FARLIGHT_TESTS_BENCH_SVO_BUILD_H

#include "base/error.h"
#include "tests/bench/svo.h"
#include "trace/axes_draw.h"
#include "trace/scene_gpu.h"

#include <stdbool.h>
#include <stdint.h>

struct svo_tree {
    struct gpu_device *device;
    uint32_t resolution, top_shift; /* cells along a side; the root's grandchildren are cells of 2^top_shift */
    bool has_planes;
    float lower_world[3], cell_world;
    float lower_cells[3], upper_cells[3]; /* whole numbers: nothing lies outside */
    struct axes_draw draw;
    struct gpu_buffer records, ids, planes;
    struct gpu_buffer fragments, current, sums, counts; /* while it is built */
    uint32_t fragments_max;                             /* that there is room for */
    struct svo_build_facts facts;
};

void svo_tree_init(struct svo_tree *tree, struct gpu_device *device, uint32_t resolution, bool has_planes);
void svo_tree_finish(struct svo_tree *tree);
uint64_t svo_tree_bytes(const struct svo_tree *tree);
bool svo_tree_build(struct svo_tree *tree, struct scene_gpu *scene, struct error *error);

#endif
