/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_SHADERS_BVH_LAYOUT_H
#define FARLIGHT_SHADERS_BVH_LAYOUT_H
#include "shared/wave.h"
#include "tree/layout.h"

/* Where a ray goes on in the next dispatch, uvec4: element; the instance that it is in; element of the top tree;
 * 1: nowhere, it is finished. */
#define BIND_BVH_PLACES BIND_TRACER_1
#define BIND_BVH_UNFINISHED BIND_PASS_4
#define BVH_UNFINISHED WAVE_STOPPED_LONG

#endif
