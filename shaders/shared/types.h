/* SPDX-License-Identifier: MIT */
/* Macros with which one file declares a struct for C and for GLSL. Shared structs have only vec4, uvec4, float and
 * uint, vec4s at multiples of 16 bytes, sizes multiples of 16, so that std430 and C agree. SHARED_SIZE brings its
 * own semicolon: GLSL 4.50 has no empty declarations. */
#ifndef FARLIGHT_SHARED_TYPES_H
#define FARLIGHT_SHARED_TYPES_H

#ifdef GL_core_profile
#define SHARED_SIZE(type, size)
#define SHARED(type) type /* a struct of this kind within another */
#else
#include <stdint.h>
typedef float vec4[4];
typedef uint32_t uvec4[4];
typedef uint32_t uint;
#define SHARED_SIZE(type, size) _Static_assert(sizeof(struct type) == (size), #type);
#define SHARED(type) struct type
#endif

#endif
