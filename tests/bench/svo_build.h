/* SPDX-License-Identifier: MIT */
/* Makes a sparse voxel octree of a scene (svo/svo.h). */
#ifndef FARLIGHT_TESTS_BENCH_SVO_BUILD_H
#define FARLIGHT_TESTS_BENCH_SVO_BUILD_H

#include "base/error.h"
#include "gpu/program.h"
#include "tests/bench/svo.h"
#include "trace/raster/draw.h"
#include "gpu_scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

enum svo_kind { SVO_KIND_CELLS, SVO_KIND_PLANES, SVO_KIND_TILES };

struct svo_tree {
    struct gpu_device *device;
    enum svo_kind kind;
    uint32_t resolution; /* cells along a side */
    uint32_t top_shift;  /* the root's grandchildren are cells of 2^top_shift */
    uint32_t levels;     /* of tiles: the root is a cube of 2^levels cells a side */
    uint32_t first_leaf; /* of tiles */
    float lower_world[3], cell_world;
    float lower_cells[3], upper_cells[3]; /* whole numbers: nothing lies outside */
    struct axes_draw draw;
    struct gpu_buffer records, ids, planes;
    struct gpu_buffer fragments, current, sums, counts; /* while it is built */
    uint32_t fragments_max;                             /* that there is room for */
    struct svo_build_facts facts;
};

void svo_tree_init(struct svo_tree *tree, struct gpu_device *device, uint32_t resolution, enum svo_kind kind);
void svo_tree_finish(struct svo_tree *tree);
uint64_t svo_tree_bytes(const struct svo_tree *tree);
bool svo_tree_build(struct svo_tree *tree, struct gpu_scene *scene, struct error *error);

/* ---- between svo_build.c and svo_tiles.c ---- */

/* The compute program, in use; `define` may be NULL. */
const struct gpu_program *svo_use(struct svo_tree *tree, const char *path, const char *define,
                                  struct error *error);
/* Room for `count` records of so many bytes behind those that there are, zeroed. */
bool svo_add_records(struct svo_tree *tree, uint32_t count, uint32_t record_bytes, struct error *error);
/* As svo_counts.children before and after the program in use has gone over records first .. the last: which ones
 * are given out next. */
uint32_t svo_allocate(struct svo_tree *tree, const struct gpu_program *program, uint32_t first, uint32_t next);
void svo_bind_fragments(struct svo_tree *tree, const struct gpu_program *program);
/* Room for the leaves' ids and planes: nobody's, and zero. */
bool svo_reserve_leaves(struct svo_tree *tree, struct error *error);
/* From fragments to a tree of tiles. */
bool svo_tiles_grow(struct svo_tree *tree, struct error *error);

#endif
