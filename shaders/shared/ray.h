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

/* The answer of a ray of an any-hit wave in one word: of red, green and blue VISIBILITY_BITS each, the cube root
 * of the transmittance in steps. Steps of a cube root are about even to the eye, as those of CIE's lightness are:
 * 0.3 % of all light, 1.4 % of a hundredth. The upper bits are set unless it is 0. */
#define VISIBILITY_BITS 10u
#define VISIBILITY_MAX 1023u
#define VISIBILITY_LIT 0x3fffffffu        /* all three: nothing is in the way */
#define VISIBILITY_BLACK (1.0f / 4096.0f) /* where no channel has more, traversal ends, and nothing is left */

#endif
