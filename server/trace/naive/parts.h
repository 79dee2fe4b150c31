/* SPDX-License-Identifier: MIT */
/* The primitives of all instances in parts, as no dispatch may take long: a GPU's driver ends one after a second
 * or two, and with it everything else that the device has in hand. */
#ifndef FARLIGHT_TRACE_NAIVE_PARTS_H
#define FARLIGHT_TRACE_NAIVE_PARTS_H

#include "gpu_scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

/* Tests of a ray: primitives, and one for each instance that is entered. */
struct naive_part {
    uint32_t first_instance, first_primitive; /* where it begins; the primitive within the instance */
    uint32_t tests;
};

/* The next part of at most that many tests (at least 2), behind `part`; the first one is behind {0}. False: there
 * is none. Parts that follow one another have each primitive of each instance once, in order. */
bool naive_next_part(const struct gpu_scene *scene, uint32_t tests_max, struct naive_part *part);

/* How many rays a dispatch of a part has, for about `tests` tests in all; a multiple of 64. */
uint32_t naive_rays_of(const struct naive_part *part, uint64_t tests);

#endif
