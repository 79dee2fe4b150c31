/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_SHADERS_BVH_LAYOUT_H
#define FARLIGHT_SHADERS_BVH_LAYOUT_H
#include "shared/wave.h"
#include "tree/layout.h"

/* Where an invocation goes on in the next dispatch, uvec4: element; the instance that its packet is in; element of
 * the top tree; bit 0: nowhere, all is finished, above it a bit for each ray of this packet and of those to come.
 */
#define BIND_BVH_PLACES BIND_TRACER_1
#define BIND_BVH_UNFINISHED BIND_PASS_4
#define BVH_UNFINISHED WAVE_STOPPED_LONG
/* Elements that a GPU visits in a dispatch, at most: a second's work of a slow one. */
#define BVH_DISPATCH_ELEMENTS_MAX (1u << 31)

#endif
