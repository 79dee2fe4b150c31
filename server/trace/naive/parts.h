/* SPDX-License-Identifier: MIT */
/* Splits the primitives of all instances into parts, so that no dispatch takes long: a GPU's driver ends one
 * after a second or two, and with it all other work on the device. */
#ifndef FARLIGHT_TRACE_NAIVE_PARTS_H
#define FARLIGHT_TRACE_NAIVE_PARTS_H

#include "gpu_scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

/* A part, in tests of a ray: one for each primitive and for each instance that is entered. */
struct naive_part {
    uint32_t first_instance, first_primitive; /* where it begins; the primitive within the instance */
    uint32_t tests;
};

/* Advances to the next part of at most `tests_max` tests (at least 2); the first one follows {0}. False: there
 * is none. Together the parts have each primitive of each instance once, in order. */
bool naive_next_part(const struct gpu_scene *scene, uint32_t tests_max, struct naive_part *part);

/* Number of rays for a dispatch of this part, for about `tests` tests in all; a multiple of 64. */
uint32_t naive_rays_of(const struct naive_part *part, uint64_t tests);

#endif
