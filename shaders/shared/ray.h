/* SPDX-License-Identifier: MIT */
/* Rays of a wave, and answers to those of any-hit waves. */
#ifndef FARLIGHT_SHARED_RAY_H
#define FARLIGHT_SHARED_RAY_H
#include "shared/types.h"

/* A ray in world space. Tracers accept directions of any length; distances are in its lengths. The integrators
 * send unit directions. A ray with t_max <= t_min is dead: it hits nothing. */
struct ray {
    vec4 origin_t_min;
    vec4 direction_t_max;
};
SHARED_SIZE(ray, 32)
/* t_min of a ray of an any-hit wave that translucent surfaces stop as opaque ones do: only cutouts let it pass. */
#define RAY_STOPS_T_MIN (-1e-20f)

/* Answer of a ray of an any-hit wave in one word: VISIBILITY_BITS each for red, green and blue, the cube root
 * of the transmittance in steps. Steps of a cube root are about even to the eye, like CIE's lightness: 0.3 % of
 * full light, 1.4 % of a hundredth. The upper bits are set unless it is 0. */
#define VISIBILITY_BITS 10u
#define VISIBILITY_MAX 1023u
#define VISIBILITY_LIT 0x3fffffffu        /* full transmittance in all three: nothing is in the way */
#define VISIBILITY_BLACK (1.0f / 4096.0f) /* traversal ends where no channel has more, and the answer is 0 */

#endif
