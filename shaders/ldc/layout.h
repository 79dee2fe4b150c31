/* SPDX-License-Identifier: MIT */
/* Layered depth cubes on the device: the build (ldc/pack.comp, ldc/sample.comp) writes them and the traversal
 * reads them.
 *
 * A cube is N x N x N cells of one size over a box of the world. It has three layered depth images, one per axis:
 * image a looks along axis a (0 x, 1 y, 2 z) towards greater values; a texel's u runs along axis (a + 1) % 3 and
 * its v along axis (a + 2) % 3. Points are in cells from the cube's lower corner: p_cell = (p_world - lower) /
 * cell; texel (u, v) covers [u, u + 1) x [v, v + 1) and is sampled at its centre. A triangle is in the image of
 * its normal's dominant axis, and in another only if it leans to that axis almost as much (AXES_OVERLAP), so a
 * sample's depth changes by at most 1 / AXES_OVERLAP cells for each cell of u or of v.
 *
 * In the paper each triangle is in one image. Then, where a surface changes from one image to another, there are
 * texels whose centre is covered neither by the last triangle of the one nor by the first of the other: cracks of
 * up to half a cell, through which a few rays of ten thousand pass. Overlapping images leave none while the
 * surface turns by less than nine degrees from one triangle to the next, and cost a seventh more samples on a
 * sphere.
 *
 * Six buffers; each holds the cubes of a tracer in order:
 *   texels    RGBA32UI, one per texel, image after image, row (v) after row
 *               x  first sample
 *               y  bits 0..7 number of samples, 8..31 first quad
 *               z  minimum depth (float, cells), w maximum; of an empty texel LDC_NO_DEPTH and -LDC_NO_DEPTH
 *   quads     RGBA32F: depths of four samples of a texel, ascending; behind the last one LDC_NO_DEPTH
 *   geometry  RG32UI, one per sample: the paper's first target
 *               x  depth (float, cells)
 *               y  geometric normal, octahedral 2 x 16 bit snorm, world space, to the outside (winding)
 *   surface   RGBA32UI, one per sample: the paper's second target (shared/surface_sample.h)
 *   primitives RG32UI, one per sample: what was sampled
 *               x  instance, LDC_OF_SPHERES
 *               y  primitive, scene-wide
 *   nodes     the hierarchy by which empty parts of the images are skipped: trace/ldc/levels.h
 *
 * Samples of a texel ascend in depth. Where several have the same depth, the first drawn one is kept: the lowest
 * instance, then the lowest primitive. The order of texels in `geometry` and `quads` differs from build to build.
 */
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
#define LDC_OF_SPHERES 0x80000000u
#define LDC_INSTANCE_MASK 0x7fffffffu
#define LDC_QUADS_MAX 0x01000000u /* for all cubes of a tracer */

/* Extension of a sample's plane beyond its texel, in cells: it closes the gaps between neighbours' planes on a
 * curved surface. */
#define LDC_SLACK 0.05f
/* Maximum deviation of a plane from its sample's depth within its texel and the slack: half a cell and the
 * slack along u, the same along v, at the maximum slope, 1 / AXES_OVERLAP. */
#define LDC_SPAN ((1.0f + 2.0f * LDC_SLACK) / AXES_OVERLAP)
/* Bins of texels by their numbers of fragments; the last bin also has those with more. */
#define LDC_HISTOGRAM_BINS 256u
/* A block: 8 x 8 texels of an image. */
#define LDC_BLOCK_SHIFT 3
/* Distance from a sample's depth at which a ray hits it in the paper's form: there 0.001 for bodies about 1
 * wide, in images of 1024 texels. */
#define LDC_TOLERANCE_CELLS 1.0f
/* Rounding error of depths and positions, in cells: some units in the last place of 4096. */
#define LDC_ROUNDING 0.002f
/* Extension of planes for closest hits, which are verified with triangles (ldc/exact.glsl), in cells: between
 * shorter planes, rays pass where surfaces bend. On a dragon of 48,000 triangles at 1024 cells 0.05 lets one
 * ray in 300 through, 0.25 one in 1300, 0.5 one in 2400, 1 one in 2800. */
#define LDC_BEYOND 0.5f
/* Distance, in cells, by which a plane that stands for triangles without samples is moved towards the ray's
 * origin: in a hollow it would lie behind them, and shadow rays from there would begin inside the body. */
#define LDC_STANDS_BEFORE 0.03f
/* A ray that begins on a surface may begin a little beyond a neighbour's plane, and would at once hit the surface
 * that it leaves. So within LDC_OWN_WAY cells of its origin a ray ignores planes that pass the origin within these
 * distances. The one for planes hit from behind, as a ray that leaves a body would hit its own surface, is
 * generous. The one for planes hit from the front, as a ray in a corner hits the other wall, and a refracted ray
 * its own surface, suffices for a curvature radius of six cells: 1.5^2 / (2 * 6). */
#define LDC_OWN_WAY 1.5f
#define LDC_OWN_BEHIND 0.5f
#define LDC_OWN_BEFORE 0.2f

/* clang-format off */
/* Cells that the plane of a sample of any image passes. The buffer of nodes, RGBA32UI, begins with the nodes, a
 * grid of blocks (raster/layout.h) of 16 x 16 x 16 cells whose parts are 4 x 4 x 4 cells; `z` of an occupied
 * node is the texel of its first occupied part, the others follow in the order of their bits. After the nodes come
 * these parts, called blocks:
 *   x, y  bits of its 64 cells that a plane passes
 *   z     entry of the first of these cells, the others follow
 *   w     unused
 * Entries, RGBA32UI:
 *   x     sample, bits 30 and 31 its image
 *   y     a further entry of the same cell, 0: there is none
 *   z, w  the sample's words of `geometry` */
/* clang-format on */
#define LDC_NODE_SHIFT 4
#define LDC_ENTRY_AXIS_SHIFT 30u
#define LDC_ENTRY_SAMPLE_MASK 0x3fffffffu
#define LDC_ENTRY_NONE 0xffffffffu

/* Data between the passes that build a cube, and for the host: counts of the build. */
struct ldc_build_counts {
    uint unslotted;              /* fragments without a slot, also those beyond the capacity */
    uint fragments;              /* fragments in total */
    uint layers_needed;          /* maximum per texel */
    uint occupied;               /* texels with fragments */
    uint places;                 /* places of kept fragments without a slot */
    uint samples_max, quads_max; /* maxima, reached if no two fragments coincide */
    uint samples, quads;         /* kept ones: coincident fragments count once */
    uint samples_lost;    /* fragments beyond the maximum number of samples of their texels, including those that
                             coincide with a kept one */
    uint fragments_wraps; /* overflows of `fragments`: the number of times that it reached 2^32; it and the
                             counts beside it are then void */
    uint pad0;
};
SHARED_SIZE(ldc_build_counts, 48)

/* Occupied texels that one invocation packs: their samples are contiguous, so one atomic places all of them. */
#define LDC_PACK_TEXELS 8u
/* Maximum of a texel's fragments that the same invocation sorts. */
#define LDC_PACK_SORTS 32u
/* Texels that one invocation of places.comp tests. */
#define LDC_PLACES_TEXELS 32u

/* clang-format off */
/* Ids are those of raster/layout.h.
 *   counts     R32UI, one per texel: its fragments
 *   occupied   R32UI: texels that have fragments, as bits: 0..11 u, 12..23 v, 24..25 axis
 *   ordered    RG32UI: depth (float, cells), id. The first `slots` fragments of each texel have a slot: slot after
 *              slot, each with all texels. The places of the others follow, those of a texel together
 *   places     R32UI, one per texel with more fragments than slots: the place of the first of the others
 *   fragments  RGBA32UI, the fragments without a slot in the order of their arrival: texel, number in the texel,
 *              depth, id
 *   found      R32UI, one per texel: layers peeled so far
 *   surface    the cube's; until sample.comp writes it, each sample has: texel, as in `occupied`, depth, id, 0
 *   peeled     RGBA32UI, two per peeled sample: the words of `surface`; those of `primitives`, 0, 0 */
/* clang-format on */

/* Binding points of the passes that build. */
#define BIND_LDC_BUILD_COUNTS BIND_TRACER_0 /* struct ldc_build_counts */
#define BIND_LDC_HISTOGRAM BIND_TRACER_1
#define IMAGE_LDC_COUNTS 0 /* ldc/build.*, and the passes after it */
#define IMAGE_LDC_ORDERED 1
#define IMAGE_LDC_FRAGMENTS 2
#define IMAGE_LDC_PLACES 2
#define IMAGE_LDC_OCCUPIED 3
#define IMAGE_LDC_FOUND 2
#define IMAGE_LDC_TEXELS 2
#define IMAGE_LDC_QUADS 3
#define IMAGE_LDC_PEELED_SURFACE 3
#define IMAGE_LDC_GEOMETRY 0
#define IMAGE_LDC_SURFACE 5
#define IMAGE_LDC_PRIMITIVES 4
#define IMAGE_LDC_NODES 0 /* ldc/levels.comp, ldc/cells.comp */
#define IMAGE_LDC_ENTRIES 1
#define UNIT_LDC_COUNTS UNIT_TRACER_0
#define UNIT_LDC_PLACES UNIT_TRACER_1
#define UNIT_LDC_FRAGMENTS UNIT_TRACER_2 /* passes of lists */
#define UNIT_LDC_FOUND UNIT_TRACER_2     /* passes of peeling */
#define UNIT_LDC_DRAWN UNIT_TRACER_4
#define UNIT_LDC_LAYER UNIT_TRACER_5
#define UNIT_LDC_OCCUPIED UNIT_TRACER_6
#define UNIT_LDC_LAYER_SURFACE UNIT_TRACER_2 /* peeled.comp */
#define UNIT_LDC_PEELED_SURFACE UNIT_TRACER_3

#endif
