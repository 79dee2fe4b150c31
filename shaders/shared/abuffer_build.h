/* SPDX-License-Identifier: MIT */
/* What the passes that build A-buffers leave to each other and to the host.
 *
 *   heads     R32UI, one a texel: the node that was linked last, plus 1; 0: none
 *   nodes     RGBA32UI, one a fragment: the node that was there before it, plus 1; depth (float, cells); bits of
 *             ABUFFER_NODE_*; id
 *   occupied  R32UI: texels that have nodes */
#ifndef FARLIGHT_SHARED_ABUFFER_BUILD_H
#define FARLIGHT_SHARED_ABUFFER_BUILD_H
#include "shared/abuffer.h"
#include "shared/types.h"

#define ABUFFER_NODE_NORMAL FACE_NORMAL_MASK
#define ABUFFER_NODE_LEAVES 0x01000000u /* its outside looks towards greater depths */
#define ABUFFER_NODE_CLOSED FACE_CLOSED

/* Counted while they are built. */
struct abuffer_build_counts {
    uint nodes;    /* all fragments, also where there was no room for them */
    uint wraps;    /* times that this came to 2^32 */
    uint occupied; /* texels with any */
    uint samples;  /* that have a place */
    uint depth_max;
    uint deep; /* texels with more than ABUFFER_LIST_MAX fragments: these are left to the host */
    uint pad0, pad1;
};
SHARED_SIZE(abuffer_build_counts, 32)

/* Texels that one invocation looks at to see what is occupied. */
#define ABUFFER_OCCUPIED_TEXELS 32u
/* Occupied texels that one invocation of resolve.comp does: their samples lie together, and places are asked for
 * once. */
#define ABUFFER_RESOLVE_TEXELS 8u
/* And it sorts those that have no more samples than this itself; sort.comp does the others. */
#define ABUFFER_RESOLVE_SORTS 32u
/* Software GL ends the loops of an invocation after 65,535 rounds: resolve.comp goes over eight such lists twice,
 * and a heap of as many takes about 25,000. */
#define ABUFFER_LIST_MAX 1024u

#endif
