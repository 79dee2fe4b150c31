/* SPDX-License-Identifier: MIT */
/* A scene of small triangles, made of one whose triangles have any size. */
#ifndef FARLIGHT_TESTS_BENCH_CUT_H
#define FARLIGHT_TESTS_BENCH_CUT_H

#include "gpu_scene/scene.h"

#include <stdint.h>

/* One mesh of all triangles as they are in world space, each halved at its longest edge until no edge is longer
 * than that; spheres, materials and all else are left out. *triangles: how many these are. NULL and *error: there
 * are no triangles, or more than there may be. */
struct scene *bench_cut_scene(const struct gpu_scene *scene, float edge_world, uint64_t *triangles,
                              struct error *error);

#endif
