/* SPDX-License-Identifier: MIT */
/* A sparse voxel octree as a tracer, for the benchmark: what voxels and A-buffers are held against, after the
 * papers that svo/svo.h names. Its cells are as many along a side as tracer_options.bench.baseline_side says, at
 * most SVO_SIDE_MAX; 0: as many.
 *
 * A hit is the primitive of lowest id in a leaf, at the place of it that is nearest to the ray. Its distance is
 * that of the middle of the ray's way through the leaf's cell, or where it intersects the leaf's plane. Rays that
 * begin on a surface pass by what is in their first cells. */
#ifndef FARLIGHT_TESTS_BENCH_SVO_H
#define FARLIGHT_TESTS_BENCH_SVO_H

#include "trace/tracer.h"

extern const struct tracer_impl svo_cells_impl; /* whatever is in a leaf fills its cell */
extern const struct tracer_impl svo_planes_impl;
extern const struct tracer_impl svo_tiles_impl; /* as it was published: svo/svo.h */

/* Of an svo tracer's last update: what the list and the tree hold, and the time until each part of it was done. */
struct svo_build_facts {
    uint32_t fragments, records, leaves;
    float cell_world;
    uint64_t voxelise_ns, tree_ns;
};
struct svo_build_facts svo_facts(const struct tracer *tracer);

#endif
