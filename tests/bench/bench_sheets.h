/* SPDX-License-Identifier: MIT */
/* A scene of a known depth complexity, and any scene of one material: for the benchmark of sampled tracers. */
#ifndef FARLIGHT_TESTS_BENCH_SHEETS_H
#define FARLIGHT_TESTS_BENCH_SHEETS_H

#include "scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

/* `count` waved sheets one behind the other along z, each over all of a unit square: seen along z there are
 * `count` surfaces everywhere, and along x and y none that leans there most. NULL: out of memory. */
struct scene *bench_sheets_scene(uint32_t count);
/* All that has a surface becomes a mirror, or glass, so that a picture asks for secondary rays everywhere. */
enum bench_material { BENCH_MIRROR, BENCH_GLASS };
bool bench_make_alike(struct scene *scene, enum bench_material material, struct error *error);

#endif
