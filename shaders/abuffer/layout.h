/* SPDX-License-Identifier: MIT */
/* clang-format off */
/* Voxels and A-buffers on the device: the build (abuffer/build.frag, abuffer/resolve.comp, abuffer/voxels.comp) writes
 * them and the traversal reads them. Hu, Huang, Zhang, Yuan, Li. Ray Tracing via GPU Rasterization. 2014.
 *
 * The structure is a cube of N x N x N cells of one size over a box of the world. It has three A-buffers, one per axis:
 * image a looks along axis a (0 x, 1 y, 2 z) towards greater values; a texel's u runs along axis (a + 1) % 3 and its v
 * along axis (a + 2) % 3. Points are in cells from the cube's lower corner: p_cell = (p_world - lower) / cell; texel
 * (u, v) covers [u, u + 1) x [v, v + 1) and is sampled at its centre. For searches by winding every triangle is in
 * all three images, so a texel's samples are all surfaces along its line; searches by planes need no triangle in
 * images where it is steep.
 *
 * Over the same cube lies a grid of V x V x V voxels, V a power of two, each N / V cells wide.
 *
 *   texels      RG32UI, one per texel, image after image, each in tiles (ABUFFER_TEXEL): first sample, number of samples
 *   samples     RG32UI, one per sample; those of a texel are contiguous and ascend in depth, at equal depths in the
 *               order of instances and primitives; padded to an even number, as the traversal reads two per texel,
 *               RGBA32UI
 *                 x  depth (float, cells)
 *                 y  bits 0..11, 12..23 geometric normal, octahedral snorm, world space, to the outside (winding);
 *                    24..30 winding behind it: the number of bodies around a point between it and the next sample,
 *                    plus ABUFFER_WINDING_ZERO; 31: it bounds a body (other samples do not change the winding)
 *   ids         R32UI, one per sample: `drawn` maps it to the instance and the primitive
 *   drawn       RGBA32UI, one per drawn instance: first id; id minus the primitive's scene-wide number; the instance;
 *               DRAWN_* (raster/layout.h). First ids ascend
 *   voxels      RGBA32UI, ABUFFER_BLOCK_TEXELS per block of 4 x 4 x 4 voxels, blocks row after row
 *                 0     the occupied ones (raster/layout.h)
 *                 1, 2  4 bits per voxel, ABUFFER_VOXEL_*: voxel i in texel 1 + i / 32, component i / 8 % 4, bits 4 (i % 8)
 *   subvoxels   RG32UI, ABUFFER_SUBVOXELS_TEXELS per voxel, x fastest: the ones of its 4 x 4 x 4 parts that the planes of samples touch
 *               within their texels, of samples in the images that they lean to; one texel for those of image x, one for
 *               y, one for z: bit x + 4 y + 16 z; at ABUFFER_SUBVOXELS_ANY all of them. If subvoxels would be smaller than texels, or V is more than
 *               ABUFFER_SUBVOXELS_VOXELS_MAX, one voxel's for all, all bits set
 *
 * While it is built, in R32I texels (image atomics), four per voxel, x fastest:
 *   sums        0..2  sum of the geometric normals of the samples in it, ABUFFER_NORMAL_UNIT for 1: it has the average's
 *                     direction. Each sample counts once: in the image of its normal's dominant axis
 *                     (for searches by planes, none)
 *               3     ABUFFER_SUM_* bits: of samples in the images that they lean to, in each voxel that a sample's plane
 *                     touches within its texel */
/* clang-format on */
#ifndef FARLIGHT_SHADERS_ABUFFER_LAYOUT_H
#define FARLIGHT_SHADERS_ABUFFER_LAYOUT_H
#include "raster/layout.h"
#include "shared/bindings.h"
#include "shared/types.h"

/* Images lie in tiles of 8 x 8 texels, row after row; the last ones of a row and of an image are padded by empty
 * texels. In a tile the left 4 x 8 texels come before the right 4 x 8, and 4 x 2 fill a line of most caches: in
 * any direction, a ray reads texels near those that it has just read. */
#define ABUFFER_TILE_TEXELS 64u
#define ABUFFER_TILES_ALONG(resolution) (((resolution) + 7u) >> 3)
/* Index of texel (u, v) of image `axis`; all arguments are uint. */
#define ABUFFER_TEXEL(tiles_along, axis, u, v)                                                                    \
    ((((axis) * (tiles_along) + ((v) >> 3)) * (tiles_along) + ((u) >> 3)) << 6 | ((u)&4u) << 3 | ((v)&7u) << 2 |  \
     ((u)&3u))

/* Extension of a sample's plane beyond its texel, in cells: it closes the gaps between neighbours' planes on a
 * curved surface. */
#define ABUFFER_SLACK 0.05f

#define ABUFFER_NORMAL_UNIT 127
/* Shifted by the axis: some sample leans to it as much as to any other axis, or almost (AXES_OVERLAP). */
#define ABUFFER_SUM_LEANS 1u
/* Shifted by the axis: some sample is so steep in that image that its depth is imprecise. */
#define ABUFFER_SUM_STEEP 8u
#define ABUFFER_SUM_OPEN 64u           /* some sample bounds no body */
#define ABUFFER_SUM_UP 128u            /* shifted by the axis: some sample leans to it and faces up it, .. */
#define ABUFFER_SUM_DOWN 1024u         /* .. or down: if both do, a body's sides are near each other */
#define ABUFFER_STEEP FACE_STEEP_BELOW /* component of a unit normal along the axis below which it is steep */

#define ABUFFER_BLOCK_TEXELS 3
#define ABUFFER_SUBVOXELS_VOXELS_MAX 128 /* 64 MiB of subvoxels */
#define ABUFFER_SUBVOXELS_TEXELS 4
#define ABUFFER_SUBVOXELS_ANY 3
/* Images that the traversal searches, bits 0..2: by winding if ABUFFER_VOXEL_BODY is set, else by the samples'
 * planes alone. A voxel of bodies whose samples are all visible in the image of the average normal's dominant axis
 * (none is steep there) is searched in that image, by winding. If samples face both ways along an axis, winding
 * does not help: a ray may pass both sides of a body between two points at which the winding is read. */
#define ABUFFER_VOXEL_IMAGES 7u
#define ABUFFER_VOXEL_BODY 8u

#define ABUFFER_WINDING_SHIFT 24u
#define ABUFFER_WINDING_MASK 0x7fu
#define ABUFFER_WINDING_ZERO 64 /* counts beyond 63 inside or outside are clamped */
#define ABUFFER_SAMPLE_BODY 0x80000000u

/* clang-format off */
/* Data between the passes that build A-buffers, and for the host.
 *
 *   heads     R32UI, one per texel: the last linked node, plus 1; 0: none
 *   nodes     RGBA32UI, one per fragment: the previous node of the texel, plus 1; depth (float, cells); bits of
 *             ABUFFER_NODE_*; id
 *   occupied  R32UI: texels that have nodes
 *   longer    R32UI: texels with more than ABUFFER_FOUR, from the first place on; with more than ABUFFER_EIGHT, from
 *             the last one back
 *   deep      R32UI: texels with more than ABUFFER_LIST_MAX */
/* clang-format on */

#define ABUFFER_NODE_NORMAL FACE_NORMAL_MASK
#define ABUFFER_NODE_LEAVES 0x01000000u /* the outside of the surface faces greater depths */
#define ABUFFER_NODE_CLOSED FACE_CLOSED

/* Counts of a build in progress. */
struct abuffer_build_counts {
    uint nodes;    /* every fragment, also those beyond the capacity */
    uint wraps;    /* overflows of `nodes`: the number of times that it reached 2^32 */
    uint occupied; /* texels with fragments */
    uint samples;  /* samples with a place in the output */
    uint depth_max;
    uint up_to_eight, beyond_eight; /* texels with more than ABUFFER_FOUR fragments */
    uint deep;                      /* texels with more than ABUFFER_LIST_MAX: the host sorts these */
    uint pad0, pad1, pad2, pad3;
};
SHARED_SIZE(abuffer_build_counts, 48)

/* Number of texels that an invocation of occupied.comp tests, at most 32: drivers also rasterise in small
 * squares, so the nodes of these texels are near each other. */
#define ABUFFER_OCCUPIED_TEXELS 32u
/* Maximum length of lists that resolve.comp sorts as it reads them, as most are. */
#define ABUFFER_FOUR 4u
#define ABUFFER_EIGHT 8u
/* Maximum length of lists sorted on the device. Software GL ends the loops of an invocation after 65,535
 * rounds: a heap of this size takes about 25,000. */
#define ABUFFER_LIST_MAX 1024u

/* Binding points of the passes that build. */
#define BIND_ABUFFER_BUILD_COUNTS BIND_TRACER_0 /* struct abuffer_build_counts */
#define IMAGE_ABUFFER_HEADS 0                   /* abuffer/build.frag, and the passes after it */
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
#define UNIT_ABUFFER_HEADS UNIT_TRACER_0 /* passes that build */
#define UNIT_ABUFFER_NODES UNIT_TRACER_1
#define UNIT_ABUFFER_OCCUPIED UNIT_TRACER_2
#define UNIT_ABUFFER_TEXELS UNIT_TRACER_3
#define UNIT_ABUFFER_LONGER UNIT_TRACER_4

#endif
