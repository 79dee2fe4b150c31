/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_SHARED_RAY_H
#define FARLIGHT_SHARED_RAY_H
#include "shared/types.h"

/* World space. The direction need not be unit length for a tracer; distances are in its lengths. The
 * integrators send unit directions. A ray with t_max <= t_min is dead: it hits nothing. */
struct ray {
    vec4 origin_t_min;
    vec4 direction_t_max;
};
SHARED_SIZE(ray, 32)
/* The t_min of a ray of an any-hit wave that translucent surfaces stop as opaque ones do: what is not cut out. */
#define RAY_STOPS_T_MIN (-1e-20f)

#endif
