/* SPDX-License-Identifier: MIT */
/* What the passes that build a layered depth cube leave to each other and to the host. */
#ifndef FARLIGHT_SHARED_LDC_BUILD_H
#define FARLIGHT_SHARED_LDC_BUILD_H
#include "shared/types.h"

/* Counted while a cube is built. */
struct ldc_build_counts {
    uint fragments;     /* that fell on texels, also where there was no room to note them */
    uint layers_needed; /* most of them on one texel */
    uint samples;       /* kept: coincident ones are one */
    uint quads;
    uint samples_lost; /* fragments behind the farthest sample that could be kept, of texels that have more */
    uint places;       /* of fragments in `ordered` */
    uint pad0, pad1;
};
SHARED_SIZE(ldc_build_counts, 32)

/* Texels that one invocation packs: their samples lie together, and places are asked for once. */
#define LDC_PACK_TEXELS 8u
/* Texels to whose fragments one invocation gives places. */
#define LDC_PLACES_TEXELS 32u

#define LDC_NO_ID 0xffffffffu

/* A drawn primitive has an id: primitives of all instances are counted through, in the order of the instances. Ids
 * ascend as instances and primitives do.
 *   drawn      RGBA32UI, one an instance: first id; what is added to a primitive's scene-wide number to make its
 *              id; the instance; 0
 *   counts     R32UI, one a texel: its fragments
 *   found      R32UI, one a texel: layers that were peeled off it
 *   fragments  RGBA32UI: texel, which one of the texel it is, depth (float, cells), id
 *   places     R32UI, one a texel: its first fragment in `ordered`
 *   ordered    RG32UI: depth, id; those of a texel together
 *   visible    RGBA32UI, one a sample: texel, depth, id, 0 */

#endif
