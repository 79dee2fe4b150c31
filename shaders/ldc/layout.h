/* SPDX-License-Identifier: MIT */
/* Layered depth cubes on the device: what the build (ldc/pack.comp, ldc/sample.comp) writes and the walk reads.
 *
 * A cube is N x N x N cells of one size over a box of the world. It has three layered depth images, one an axis:
 * image a looks along axis a (0 x, 1 y, 2 z) towards greater values; a texel's u runs along axis (a + 1) % 3 and
 * its v along axis (a + 2) % 3. Places are in cells from the cube's lower corner: p_cell = (p_world - lower) /
 * cell; texel (u, v) covers [u, u + 1) x [v, v + 1) and was sampled at its middle. A triangle is in the image of
 * the axis that its normal leans to most, and of no other but where it leans to that almost as much
 * (AXES_OVERLAP), so a sample's depth changes by at most 1 / AXES_OVERLAP cells for each cell of u or of v.
 *
 * The paper has each triangle in one image. Where a surface goes over from one image to another there are texels
 * then whose middle the last triangle of the one does not reach, nor does the first of the other: cracks of up to
 * half a cell, through which a few rays of ten thousand see what is behind. Overlapping images leave none while
 * the surface turns by less than nine degrees from one triangle to the next, and cost a seventh more samples on a
 * sphere.
 *
 * Five buffers, the cubes of a tracer one behind the other in each:
 *   texels    RGBA32UI, one a texel, image after image, row (v) after row
 *               x  first sample
 *               y  bits 0..7 number of samples, 8..31 first quad
 *               z  least depth (float, cells), w greatest; of an empty texel LDC_NO_DEPTH and -LDC_NO_DEPTH
 *   quads     RGBA32F: depths of four samples of a texel, ascending; behind the last one LDC_NO_DEPTH
 *   geometry  RG32UI, one a sample: the paper's first target
 *               x  depth (float, cells)
 *               y  geometric normal, octahedral 2 x 16 bit snorm, world space, to the outside (winding)
 *   surface   RGBA32UI, one a sample: the paper's second target (shared/surface_sample.h)
 *   nodes     what of the images' texels can be skipped: trace/ldc/levels.h
 *
 * Samples of a texel ascend in depth. Of several at the same depth the one that was drawn first is there: lowest
 * instance, then lowest primitive. Where samples and quads of a texel lie among the others differs from build to
 * build. */
#ifndef FARLIGHT_SHADERS_LDC_LAYOUT_H
#define FARLIGHT_SHADERS_LDC_LAYOUT_H
#include "raster/layout.h"
#include "shared/bindings.h"
#include "shared/types.h"

#define LDC_NO_DEPTH 1e30f
#define LDC_NO_DEPTH_BITS 0x7149f2cau
#define LDC_TEXEL_COUNT_MASK 255u
#define LDC_LAYERS_MAX LDC_TEXEL_COUNT_MASK
#define LDC_TEXEL_QUAD_SHIFT 8u
#define LDC_QUADS_MAX 0x01000000u /* of all cubes of a tracer */

/* clang-format off */
/* Cells: which of them a sample's plane passes, of whatever image. In the buffer of nodes, RGBA32UI, first the nodes,
 * a grid of blocks (raster/layout.h) of 16 x 16 x 16 cells whose parts are 4 x 4 x 4 cells; `z` of one that holds
 * something is the texel of its first part, the others lie behind it in the order of their bits. Then these parts,
 * called blocks:
 *   x, y  which of its 64 cells a plane passes
 *   z     entry of the first of these, the others lie behind it
 *   w     unused
 * Entries, RGBA32UI:
 *   x     sample, bits 30 and 31 its image
 *   y     a further entry of the same cell, 0: there is none
 *   z, w  what the sample has in `geometry` */
/* clang-format on */
#define LDC_NODE_SHIFT 4
#define LDC_ENTRY_AXIS_SHIFT 30u
#define LDC_ENTRY_SAMPLE_MASK 0x3fffffffu
#define LDC_ENTRY_NONE 0xffffffffu

/* What the passes that build a cube leave to each other and to the host. */

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
/* Ids are those of raster/layout.h.
 *   counts     R32UI, one a texel: its fragments
 *   occupied   R32UI: texels that have fragments, as bits: 0..11 u, 12..23 v, 24..25 axis
 *   ordered    RG32UI: depth (float, cells), id. The first `slots` fragments of each texel have a slot: texels
 *              side by side, slot after slot. Then the others' places, those of a texel together
 *   places     R32UI, one a texel with more fragments than slots: the first of the others
 *   fragments  RGBA32UI, those others as they came: texel, which one of the texel it is, depth, id
 *   found      R32UI, one a texel: layers that were peeled off it
 *   visible    RGBA32UI, one a sample: texel, depth, id, 0 */
/* clang-format on */

/* Binding points. */
#define BIND_LDC_BUILD_COUNTS BIND_TRACER_0 /* struct ldc_build_counts */
#define BIND_LDC_HISTOGRAM BIND_TRACER_1
#define IMAGE_LDC_COUNTS 0 /* ldc/build.*, and the passes behind it */
#define IMAGE_LDC_ORDERED 1
#define IMAGE_LDC_FRAGMENTS 2
#define IMAGE_LDC_PLACES 2
#define IMAGE_LDC_OCCUPIED 3
#define IMAGE_LDC_FOUND 2
#define IMAGE_LDC_TEXELS 2
#define IMAGE_LDC_QUADS 3
#define IMAGE_LDC_VISIBLE 4
#define IMAGE_LDC_PEELED_SURFACE 3
#define IMAGE_LDC_GEOMETRY 0
#define IMAGE_LDC_SURFACE 5
#define IMAGE_LDC_NODES 0 /* ldc/levels.comp, ldc/cells.comp */
#define IMAGE_LDC_ENTRIES 1
#define UNIT_LDC_COUNTS UNIT_TRACER_0
#define UNIT_LDC_PLACES UNIT_TRACER_1
#define UNIT_LDC_FRAGMENTS UNIT_TRACER_2 /* in passes of lists, .. */
#define UNIT_LDC_FOUND UNIT_TRACER_2     /* .. of peeling */
#define UNIT_LDC_VISIBLE UNIT_TRACER_3
#define UNIT_LDC_DRAWN UNIT_TRACER_4
#define UNIT_LDC_LAYER UNIT_TRACER_5
#define UNIT_LDC_OCCUPIED UNIT_TRACER_6
#define UNIT_LDC_LAYER_SURFACE UNIT_TRACER_0 /* of peeling too */
#define UNIT_LDC_PEELED_SURFACE UNIT_TRACER_3

#endif
