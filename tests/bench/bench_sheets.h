/* SPDX-License-Identifier: MIT */
/* A scene of a known depth complexity, and mirrors of any scene: for the benchmark of layered depth cubes. */
#ifndef FARLIGHT_TESTS_BENCH_SHEETS_H
#define FARLIGHT_TESTS_BENCH_SHEETS_H

#include "scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

/* `count` waved sheets one behind the other along z, each over all of a unit square: seen along z there are
 * `count` surfaces everywhere, and along x and y none that leans there most. NULL: out of memory. */
struct scene *bench_sheets_scene(uint32_t count);
/* All that has a surface becomes a mirror, so that a picture asks for reflections everywhere. */
bool bench_make_mirrors(struct scene *scene, struct error *error);

#endif
