/* SPDX-License-Identifier: MIT */
/* Bindings and limits of the tracer `bvh`; its trees are in tree/layout.h. */
#ifndef FARLIGHT_SHADERS_BVH_LAYOUT_H
#define FARLIGHT_SHADERS_BVH_LAYOUT_H
#include "shared/wave.h"
#include "tree/layout.h"

/* Place where an invocation resumes in the next dispatch, uvec4: element; the instance that its packet is in;
 * element of the top tree; bit 0: finished; above it a bit for each ray of this packet and of those to come.
 * A ray through wide nodes has more texels behind it: its group of nodes and the height of its stack, then the
 * stack's groups in pairs. */
#define BVH_WIDE_PLACE_TEXELS (2u + BVH_WIDE_DEPTH_MAX / 2u)
#define BIND_BVH_PLACES BIND_TRACER_1
#define BIND_BVH_UNFINISHED BIND_PASS_4
#define BVH_UNFINISHED WAVE_STOPPED_LONG
/* Maximum of elements that a GPU visits in a dispatch: a second's work of a slow one. */
#define BVH_DISPATCH_ELEMENTS_MAX (1u << 31)

#endif
