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
 *   surface   RGBA32UI, one a sample: the paper's second target. Shares are what textures and vertex colours give,
 *             filtered to the size of a cell; what the material itself says is multiplied when the hit is shaded,
 *             so an edit of it needs no new cube
 *               x  bits 0..23 base colour, r g b, sRGB, 8 bits each; 24..31 alpha
 *               y  shading normal, normal and bump maps applied, as the geometric one
 *               z  bits 0..23 index into the materials; 24..27 share of metallic, 28..31 of transmission (of 15)
 *               w  bits 0..7 share of roughness, 8..15 of occlusion (strength applied); 16..20, 21..26, 27..31
 *                  r g b of the share of emission, square roots
 *   nodes     what of the images' texels can be skipped: ldc_levels.h
 *
 * Samples of a texel ascend in depth. Of several at the same depth the one that was drawn first is there: lowest
 * instance, then lowest primitive. Where samples and quads of a texel lie among the others differs from build to
 * build. */
#ifndef FARLIGHT_SHARED_LDC_H
#define FARLIGHT_SHARED_LDC_H
#include "shared/axes.h"
#include "shared/types.h"

#define LDC_NO_DEPTH 1e30f
#define LDC_NO_DEPTH_BITS 0x7149f2cau
#define LDC_TEXEL_COUNT_MASK 255u
#define LDC_LAYERS_MAX LDC_TEXEL_COUNT_MASK
#define LDC_TEXEL_QUAD_SHIFT 8u
#define LDC_QUADS_MAX 0x01000000u /* of all cubes of a tracer */
#define LDC_MATERIAL_MASK 0x00ffffffu
#define LDC_METALLIC_SHIFT 24u
#define LDC_TRANSMISSION_SHIFT 28u

/* clang-format off */
/* Cells: which of them a sample's plane passes, of whatever image. In the buffer of nodes, RGBA32UI, first the nodes,
 * row after row, each of 16 x 16 x 16 cells:
 *   x, y  which of its 64 blocks of 4 x 4 x 4 cells hold something: bit x + 4 y + 16 z
 *   z     of a node with blocks: the texel of its first, the others lie behind it in the order of their bits.
 *         Of one without: 8 x 4 bits, for the octants of a direction (bit 0, 1, 2: x, y, z run down): so many nodes
 *         along each side of a cube that begins with this one and reaches that way hold nothing either
 *   w     while they are made: what is empty along x (2 x 4 bits), then of squares in x and y (4 x 4 bits)
 * then the blocks:
 *   x, y  which of its 64 cells a plane passes
 *   z     entry of the first of these, the others lie behind it
 *   w     unused
 * Entries, RGBA32UI:
 *   x     sample, bits 30 and 31 its image
 *   y     a further entry of the same cell, 0: there is none
 *   z, w  what the sample has in `geometry` */
/* clang-format on */
#define LDC_NODE_SHIFT 4
#define LDC_NODE_EIGHT 0x00330033u /* 2 x 2 x 2 of 32 bits */
#define LDC_NODE_FAR 15u
#define LDC_ENTRY_AXIS_SHIFT 30u
#define LDC_ENTRY_SAMPLE_MASK 0x3fffffffu
#define LDC_ENTRY_NONE 0xffffffffu

#endif
