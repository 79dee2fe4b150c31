/* SPDX-License-Identifier: MIT */
/* What the passes that build a layered depth cube leave to each other and to the host. */
#ifndef FARLIGHT_SHARED_LDC_BUILD_H
#define FARLIGHT_SHARED_LDC_BUILD_H
#include "shared/axes.h"
#include "shared/types.h"

/* Counted while a cube is built. */
struct ldc_build_counts {
    uint unslotted;     /* fragments that there was no slot for, also where there was no room to note them */
    uint fragments;     /* all that fell on texels */
    uint layers_needed; /* most of them on one texel */
    uint occupied;      /* texels with any */
    uint places;        /* for fragments without a slot, of those that are kept */
    uint samples_max, quads_max; /* if no two fragments coincide */
    uint samples, quads;         /* kept: coincident ones are one */
    uint samples_lost;    /* fragments beyond the samples of texels that have as many as may be kept; those that
                             coincide with one that is kept are among them */
    uint fragments_wraps; /* times that `fragments` came to 2^32: it and what is counted beside it say nothing */
    uint pad0;
};
SHARED_SIZE(ldc_build_counts, 48)

/* Occupied texels that one invocation packs: their samples lie together, and places are asked for once. */
#define LDC_PACK_TEXELS 8u
/* And it sorts those that have no more fragments than this itself. */
#define LDC_PACK_SORTS 32u
/* Texels that one invocation looks at to see what is occupied. */
#define LDC_PLACES_TEXELS 32u

/* clang-format off */
/* Ids are those of shared/axes.h.
 *   counts     R32UI, one a texel: its fragments
 *   occupied   R32UI: texels that have fragments, as bits: 0..11 u, 12..23 v, 24..25 axis
 *   ordered    RG32UI: depth (float, cells), id. The first `slots` fragments of each texel have a slot: texels
 *              side by side, slot after slot. Then the others' places, those of a texel together
 *   places     R32UI, one a texel with more fragments than slots: the first of the others
 *   fragments  RGBA32UI, those others as they came: texel, which one of the texel it is, depth, id
 *   found      R32UI, one a texel: layers that were peeled off it
 *   visible    RGBA32UI, one a sample: texel, depth, id, 0 */
/* clang-format on */

#endif
