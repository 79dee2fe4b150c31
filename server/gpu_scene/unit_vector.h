/* SPDX-License-Identifier: MIT */
/* Twins in C of pack_unit() and pack_unit_24() in shaders/common/math.glsl. */
#ifndef FARLIGHT_GPU_SCENE_UNIT_VECTOR_H
#define FARLIGHT_GPU_SCENE_UNIT_VECTOR_H

#include <stdint.h>

uint32_t unit_vector_pack(const float v[3]);    /* v need not be unit; 0 if it has no direction */
uint32_t unit_vector_pack_24(const float v[3]); /* v need not be unit; 0 if it has no direction */

#endif
