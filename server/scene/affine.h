/* SPDX-License-Identifier: MIT */
/* 3x4 row-major affine transforms; chained arithmetic is in double. Thin over cglm. */
#ifndef FARLIGHT_SCENE_AFFINE_H
#define FARLIGHT_SCENE_AFFINE_H

#include <stdbool.h>

void affine_identity(float m[12]);
void affine_multiply(float a_from_c[12], const float a_from_b[12], const float b_from_c[12]); /* may alias */
bool affine_invert(float b_from_a[12], const float a_from_b[12]); /* false: singular, output zero */
void affine_point(float out[3], const float m[12], const float point[3]);
void affine_vector(float out[3], const float m[12], const float vector[3]);
/* Bounds of a transformed box. */
void affine_bounds(float out_lower[3], float out_upper[3], const float m[12], const float lower[3],
                   const float upper[3]);

#endif
