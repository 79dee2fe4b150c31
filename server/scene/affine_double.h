/* SPDX-License-Identifier: MIT */
/* 3x4 transforms in double, for chains of nodes: a single rounding at the end does not drift. */
#ifndef FARLIGHT_SCENE_AFFINE_DOUBLE_H
#define FARLIGHT_SCENE_AFFINE_DOUBLE_H

#include <stdbool.h>

void affine_double_identity(double m[12]);
void affine_double_multiply(double a_from_c[12], const double a_from_b[12],
                            const float b_from_c[12]);                    /* may alias */
bool affine_double_invert(float b_from_a[12], const double a_from_b[12]); /* false: singular, output zero */
bool affine_double_round(float out[12], const double m[12]);              /* false: an entry exceeds a float */

#endif
