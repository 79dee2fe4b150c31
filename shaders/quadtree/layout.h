/* SPDX-License-Identifier: MIT */
/* The structure of the tracer `quadtree` on the device: quadtrees over the surfaces that a view sees, nearest
 * first. Widmer, Pajak, Schulz, Pulli, Kautz, Goesele, Luebke. An Adaptive Acceleration Structure for Screen-space
 * Ray Tracing. 2015, sections 3.2 to 3.4.
 *
 * A view is one face, or six: those of a cube round the eye. A face has a right, a down and a forward direction; a
 * point at (X, Y, Z) along these from the eye lies at the texel coordinates (x, y) = centre + scale * (X, Y) / Z,
 * and has the depth w = unit / Z, where the unit is a share of the scene's size that suits half floats: in (x, y,
 * w) planes are planes and rays are segments, and w grows towards the eye. Of an orthographic view (x, y) = centre
 * + scale * (X, Y) and w = (far - Z) / (far - near). Texel (i, j) covers [i, i + 1) x [j, j + 1); row 0 is the
 * uppermost.
 *
 * Each face has up to three layers: layer l holds at each texel's centre the surface that l others hide. A slice
 * is one layer of one face, number face * layers + layer. It is padded to a multiple of QUADTREE_SIDE texels along
 * both sides, and has levels 0 (texels) to QUADTREE_TOP; node (x, y) of a level covers the texels from (x, y) <<
 * level on.
 *
 *   visible  RG32UI array texture, a layer a slice: instance + 1 and scene-wide primitive, as render's visibility
 *            buffer has them (VISIBLE_NOTHING, VISIBLE_DISC of shared/path.h)
 *   nodes    RG32UI texel buffer: slice after slice, level after level, row after row. A node is one of
 *     plane  x: sign bit set; w at the node's centre without its lowest bit; lowest bit: a texel beside it, or one
 * of its own, holds a surface that does not go on from this one (the paper's flag O) y: slopes of w per texel
 * along x (low half) and y, times QUADTREE_SLOPE_SCALE, half floats box    x: greatest w, y: least w, both floats;
 * sign bit of y set: there are gaps, where nothing is, and y is the least w of surfaces, up to a texel beside them
 *   Where nothing is there is a plane of w = 0: no ray reaches it.
 *   Behind all nodes, for each face: x: the greatest w of its first layer; y unused */
#ifndef FARLIGHT_SHADERS_QUADTREE_LAYOUT_H
#define FARLIGHT_SHADERS_QUADTREE_LAYOUT_H
#include "shared/bindings.h"
#include "shared/types.h"

#define QUADTREE_TOP 7 /* the paper has nine levels at most, besides the root */
#define QUADTREE_SIDE 128u
#define QUADTREE_FACES_MAX 6u
#define QUADTREE_LAYERS_MAX 3u
#define QUADTREE_SLOPE_SCALE 1024.0f
#define QUADTREE_SLOPE_MAX 65504.0f /* after the scale: the greatest half float */

/* The uniforms of every pass of the tracer; a std140 block. */
struct quadtree_uniforms {
    vec4 face_from_world[18]; /* three rows a face: right, down, forward, of unit length */
    vec4 eye_world;           /* w: of the sphere round it within which other eyes may be, radius, metres */
    vec4 scale_centre;        /* xy: texels a unit of X / Z, or of X; zw: where the axis of the view is */
    vec4 depths;        /* x: the unit, the distance at which w is 1, metres, or near if orthographic; y: far,
                           beyond which there is nothing but discs; z: 1 if orthographic; w: near */
    vec4 bounds;        /* x: the greatest difference of w that a plane over several texels may have, from an eye
                           far from it: unit pixels / (f radius); y: cosine of the greatest angle between it and
                           those of its children, 0: any; z: w at the distance where both are twice as much, 0:
                           they do not grow; w: radius / unit, of the sphere of eyes for which x holds */
    uint width, height; /* of a face, texels */
    uint padded_width, padded_height;
    uint faces, layers;
    uint slice_nodes; /* nodes of a slice */
    uint pad0;
};
SHARED_SIZE(quadtree_uniforms, 384)

/* What a frame's rays of one kind came to. */
struct quadtree_counts {
    uint rays;
    /* Of shadow rays that do not end behind the first layer also what passed by gaps and may have been behind
     * there. */
    uint behind_first, behind_second; /* that were behind the first layer somewhere, and the second */
    uint behind_last;                 /* that found nothing before they came behind the last one */
    uint outside;                     /* that found nothing in what the view sees, and left it */
    uint pad0, pad1, pad2;
};
SHARED_SIZE(quadtree_counts, 32)
#define QUADTREE_KINDS 4 /* of rays; behind their counts in the buffer are those of eyes.comp: */
/* By number, the eyes' rays that came to something else than what they meet in the first layer: 1 or 2, they were
 * behind that many layers, and one of these. They are too many to count all of them. */
#define QUADTREE_DEAD 3u /* beyond the picture's edge */
#define QUADTREE_BEHIND 4u
#define QUADTREE_OUTSIDE 8u
#define QUADTREE_OUTCOMES 12

/* A ray that is within so many texels of its origin may pass the extension of a plane beside the surface that it
 * began on, and one that is behind a plane may be before the next: half a texel, and its diagonal's. */
#define QUADTREE_OWN_WAY 1.5f
#define QUADTREE_FINE                                                                                             \
    2.0f /* texels: primitives as narrow may lie between the middles of texels, and be seen by none */
#define QUADTREE_DEEP 0.05f /* of w: what is so far behind a plane is behind the surface */

/* Of w, in bounds: a plane and the extension of another one through a texel are no farther apart. What lies behind
 * the farthest surface by that is at most so many times as far. */
#define QUADTREE_PLANES_APART 2.0f
#define QUADTREE_FARTHER_MAX 16.0f
/* Where a ray is taken to end that was before nothing: a share of its way through the view. */
#define QUADTREE_ALMOST_END 0.999f

/* What beams.comp says of a tile: the level at which its rays begin, and whether all of them do so in the view. */
#define QUADTREE_BEAM_LEVEL 7
#define QUADTREE_BEAM_INSIDE 8

/* Of a view that is one face: an eye beside its own looks past what that does not see, until its rays come into
 * the view. Within so many radii of the view's eye that is taken to be empty, and farther away it is unknown. Of
 * an eye that is s aside, and a view whose outermost ray has the tangent t, a ray with the tangent a comes in at
 * s sqrt(1 + t^2) / (t - a) from the view's eye. With 8, which is 1.2 m of the usual radius, an eye 65 mm aside
 * sees all of its picture by a view 16 to 9 of 50 degrees with the usual margin, at 1.06 m; both of a pair do down
 * to 20 degrees. */
#define QUADTREE_FREE_RADII 8.0f

#define BIND_QUADTREE_COUNTS BIND_TRACER_0
#define UNIFORM_QUADTREE 3
#define UNIT_QUADTREE_VISIBLE UNIT_TRACER_0
#define UNIT_QUADTREE_NODES UNIT_TRACER_1
#define UNIT_QUADTREE_BEAMS UNIT_TRACER_5
#define UNIT_QUADTREE_DEPTH UNIT_TRACER_2 /* of the layer before the one that is drawn */
/* Passes that build. Of one slice: its leaves as planes without flags; of all, the levels above the leaves: how
 * far a plane is from those of the leaves at most. */
#define UNIT_QUADTREE_PLANES UNIT_TRACER_3
#define UNIT_QUADTREE_ERRORS UNIT_TRACER_4
#define IMAGE_QUADTREE_NODES 0
#define IMAGE_QUADTREE_PLANES 1
#define IMAGE_QUADTREE_ERRORS 2
#define IMAGE_QUADTREE_BEAMS 0

/* Two texels side by side show surfaces that go on from one another if their planes differ by no more than this
 * share of w and bounds.x, in the middle of their common border. Prototypes had cracks up to it. */
#define QUADTREE_EDGE_SHARE 0.001953125f
/* The tolerance may grow with distance up to so many times. */
#define QUADTREE_GROWTH_MAX 4.0f

#endif
