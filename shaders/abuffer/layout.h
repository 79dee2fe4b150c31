/* SPDX-License-Identifier: MIT */
/* clang-format off */
/* Voxels and A-buffers on the device: what the build (abuffer/build.frag, abuffer/resolve.comp, abuffer/voxels.comp)
 * writes and the walk reads. Hu, Huang, Zhang, Yuan, Li. Ray Tracing via GPU Rasterization. 2014.
 *
 * The structure is a cube of N x N x N cells of one size over a box of the world. It has three A-buffers, one an axis:
 * image a looks along axis a (0 x, 1 y, 2 z) towards greater values; a texel's u runs along axis (a + 1) % 3 and its v
 * along axis (a + 2) % 3. Places are in cells from the cube's lower corner: p_cell = (p_world - lower) / cell; texel
 * (u, v) covers [u, u + 1) x [v, v + 1) and was sampled at its middle. Every triangle is in all three images, so a
 * texel's samples are all surfaces along its line.
 *
 * Over the same cube lies a grid of V x V x V voxels, V a power of two, each N / V cells wide.
 *
 *   texels      RG32UI, one a texel, image after image, each in tiles (ABUFFER_TEXEL): first sample, number of samples
 *   samples     RG32UI, one a sample; those of a texel lie together and ascend in depth, of equal depths in the order of
 *               instances and primitives
 *               for an even number there is room, as the walk reads two a texel, RGBA32UI
 *                 x  depth (float, cells)
 *                 y  bits 0..11, 12..23 geometric normal, octahedral snorm, world space, to the outside (winding);
 *                    24..30 winding behind it: of how many bodies a point between it and the next sample is inside, plus
 *                    ABUFFER_WINDING_ZERO; 31: it bounds a body (others leave the winding as it is)
 *   ids         R32UI, one a sample: what it is of; the instance and the primitive are found by `drawn`
 *   drawn       RGBA32UI, one an instance that was drawn: first id; what is added to a primitive's scene-wide number to
 *               make its id; the instance; DRAWN_* (raster/layout.h). First ids ascend
 *   voxels      RGBA32UI, ABUFFER_BLOCK_TEXELS a block of 4 x 4 x 4 voxels, blocks row after row
 *                 0     which hold something (raster/layout.h)
 *                 1, 2  4 bits a voxel, ABUFFER_VOXEL_*: voxel i in texel 1 + i / 32, component i / 8 % 4, bits 4 (i % 8)
 *   subvoxels   RG32UI, three a voxel, x fastest: in which of 4 x 4 x 4 parts of it the squares of samples' planes are that
 *               texels show, of samples in the images that they lean to; one texel for those that look along x most, one
 *               for y, one for z: bit x + 4 y + 16 z. Where subvoxels would be smaller than texels, or V is more than
 *               ABUFFER_SUBVOXELS_VOXELS_MAX, three for all voxels, all bits set
 *
 * While it is built, in R32I texels (image atomics), four a voxel, x fastest:
 *   sums        0..2  sum of the geometric normals of the samples in it, ABUFFER_NORMAL_UNIT for 1: their direction is
 *                     that of the average. Of each sample once: that of the image which its normal leans to most
 *               3     ABUFFER_SUM_* bits: of samples in the images that they lean to, in each voxel that the square of
 *                     plane touches which is seen through their texel */
/* clang-format on */
#ifndef FARLIGHT_SHADERS_ABUFFER_LAYOUT_H
#define FARLIGHT_SHADERS_ABUFFER_LAYOUT_H
#include "raster/layout.h"
#include "shared/bindings.h"
#include "shared/types.h"

/* Images lie in tiles of 8 x 8 texels, row after row, the last ones of a row and of an image padded by empty
 * texels. In a tile 4 x 8 texels lie before the other 4 x 8, and 4 x 2 fill a line of most caches: whichever way a
 * ray goes it finds what it reads next near what it has read. */
#define ABUFFER_TILE_TEXELS 64u
#define ABUFFER_TILES_ALONG(resolution) (((resolution) + 7u) >> 3)
/* The number of texel (u, v) of image `axis`; all are uint. */
#define ABUFFER_TEXEL(tiles_along, axis, u, v)                                                                    \
    ((((axis) * (tiles_along) + ((v) >> 3)) * (tiles_along) + ((u) >> 3)) << 6 | ((u)&4u) << 3 | ((v)&7u) << 2 |  \
     ((u)&3u))

#define ABUFFER_NORMAL_UNIT 127
/* Times 2 to the axis: some sample leans to it as much as to any, or almost (AXES_OVERLAP). */
#define ABUFFER_SUM_LEANS 1u
/* Times 2 to the axis: some sample is so steep in that image that its depths say little. */
#define ABUFFER_SUM_STEEP 8u
#define ABUFFER_SUM_OPEN 64u           /* some sample bounds no body */
#define ABUFFER_SUM_UP 128u            /* times 2 to the axis: some sample leans to it and looks up it, .. */
#define ABUFFER_SUM_DOWN 1024u         /* .. or down: where both do, a body's sides are near each other */
#define ABUFFER_STEEP FACE_STEEP_BELOW /* component of a unit normal along the axis below which it is */

#define ABUFFER_BLOCK_TEXELS 3
#define ABUFFER_SUBVOXELS_VOXELS_MAX 128 /* 48 MiB of them */
/* In which images the walk looks, bits 0..2; it does by winding where ABUFFER_VOXEL_BODY is set, and by the
 * samples' planes alone where it is not. A voxel of bodies whose samples can all be seen in the image that the
 * average normal leans to most (none is steep there) is looked for in that one, by winding. Where samples look
 * both ways along an axis winding is no help: a ray may pass both sides of a body between two places that it is
 * asked of. */
#define ABUFFER_VOXEL_IMAGES 7u
#define ABUFFER_VOXEL_BODY 8u

#define ABUFFER_WINDING_SHIFT 24u
#define ABUFFER_WINDING_MASK 0x7fu
#define ABUFFER_WINDING_ZERO 64 /* deeper than 63 inside or outside counts as that */
#define ABUFFER_SAMPLE_BODY 0x80000000u

/* clang-format off */
/* What the passes that build A-buffers leave to each other and to the host.
 *
 *   heads     R32UI, one a texel: the node that was linked last, plus 1; 0: none
 *   nodes     RGBA32UI, one a fragment: the node that was there before it, plus 1; depth (float, cells); bits of
 *             ABUFFER_NODE_*; id
 *   occupied  R32UI: texels that have nodes
 *   longer    R32UI: texels with more than ABUFFER_FOUR, from the first place on; with more than ABUFFER_EIGHT, from
 *             the last one back
 *   deep      R32UI: texels with more than ABUFFER_LIST_MAX */
/* clang-format on */

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

/* Binding points. */
#define BIND_ABUFFER_BUILD_COUNTS BIND_TRACER_0 /* struct abuffer_build_counts */
#define IMAGE_ABUFFER_HEADS 0 /* abuffer/build.frag, and the passes behind it: abuffer/layout.h */
#define IMAGE_ABUFFER_NODES 1
#define IMAGE_ABUFFER_SUMS 2
#define IMAGE_ABUFFER_SUBVOXELS 3
#define IMAGE_ABUFFER_OCCUPIED 0
#define IMAGE_ABUFFER_TEXELS 0
#define IMAGE_ABUFFER_SAMPLES 1
#define IMAGE_ABUFFER_IDS 2
#define IMAGE_ABUFFER_DEEP 3
#define IMAGE_ABUFFER_LONGER 4
#define IMAGE_ABUFFER_VOXELS 0           /* abuffer/voxels.comp */
#define UNIT_ABUFFER_HEADS UNIT_TRACER_0 /* while they are built */
#define UNIT_ABUFFER_NODES UNIT_TRACER_1
#define UNIT_ABUFFER_OCCUPIED UNIT_TRACER_2
#define UNIT_ABUFFER_TEXELS UNIT_TRACER_3
#define UNIT_ABUFFER_LONGER UNIT_TRACER_4

#endif
