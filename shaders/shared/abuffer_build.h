/* SPDX-License-Identifier: MIT */
/* What the passes that build A-buffers leave to each other and to the host.
 *
 *   heads     R32UI, one a texel: the node that was linked last, plus 1; 0: none
 *   nodes     RGBA32UI, one a fragment: the node that was there before it, plus 1; depth (float, cells); bits of
 *             ABUFFER_NODE_*; id
 *   occupied  R32UI: texels that have nodes
 *   longer    R32UI: texels with more than ABUFFER_FOUR, from the first place on; with more than ABUFFER_EIGHT,
 * from the last one back deep      R32UI: texels with more than ABUFFER_LIST_MAX */
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
    uint up_to_eight, beyond_eight; /* texels with more than ABUFFER_FOUR fragments */
    uint deep;                      /* with more than ABUFFER_LIST_MAX: these are left to the host */
    uint pad0, pad1, pad2, pad3;
};
SHARED_SIZE(abuffer_build_counts, 48)

/* Texels that one invocation looks at to see what is occupied, at most 32: drivers rasterise in small squares,
 * too, so nodes of these lie near each other. */
#define ABUFFER_OCCUPIED_TEXELS 32u
/* Lists that resolve.comp sorts as it takes them: most have no more than four. */
#define ABUFFER_FOUR 4u
#define ABUFFER_EIGHT 8u
/* Software GL ends the loops of an invocation after 65,535 rounds: a heap of as many
 * takes about 25,000. */
#define ABUFFER_LIST_MAX 1024u

#endif
