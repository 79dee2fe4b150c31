/* SPDX-License-Identifier: MIT */
/* clang-format off */
/* The structure of the tracer `quadtree` on the device: quadtrees over the surfaces that a view sees, nearest first.
 * Widmer, Pajak, Schulz, Pulli, Kautz, Goesele, Luebke. An Adaptive Acceleration Structure for Screen-space Ray
 * Tracing. 2015, sections 3.2 to 3.4.
 *
 * A view is one face, or six: those of a cube round the eye. A face has a right, a down and a forward direction; a
 * point at (X, Y, Z) along these from the eye lies at the texel coordinates (x, y) = centre + scale * (X, Y) / Z, and
 * has the depth w = unit / Z, where the unit is a share of the scene's size that suits half floats: in (x, y, w) planes
 * are planes and rays are segments, and w grows towards the eye. In an orthographic view (x, y) = centre + scale *
 * (X, Y) and w = (far - Z) / (far - near). Texel (i, j) covers [i, i + 1) x [j, j + 1); row 0 is the uppermost.
 *
 * Each face has up to three layers: layer l holds at each texel's centre the surface that l others hide. A slice is one
 * layer of one face, number face * layers + layer. It is padded to a multiple of QUADTREE_SIDE texels along both sides,
 * and has levels 0 (texels) to QUADTREE_TOP; node (x, y) of a level covers the texels from (x, y) << level on.
 *
 *   visible  RG32UI array texture, a layer per slice: instance + 1 and scene-wide primitive, as in render's visibility
 *            buffer (VISIBLE_NOTHING, VISIBLE_DISC of shared/path.h)
 *   nodes    RG32UI texel buffer: slice after slice, level after level, row after row. A node is one of
 *     plane  x: sign bit set; w at the node's centre without its lowest bit; lowest bit: a texel beside it, or one of
 *               its own, holds a surface that does not continue this one (the paper's flag O)
 *            y: slopes of w per texel along x (low half) and y, times QUADTREE_SLOPE_SCALE, half floats
 *     box    x: maximum w, y: minimum w, both floats; sign bit of y set: there are gaps without a surface, and y is the
 *               minimum w of surfaces, up to a texel beside them
 *   An empty node is a plane of w = 0, which no ray reaches.
 *   Behind all nodes, for each face: x: maximum w of its first layer; y unused */
/* clang-format on */
#ifndef FARLIGHT_SHADERS_QUADTREE_LAYOUT_H
#define FARLIGHT_SHADERS_QUADTREE_LAYOUT_H
#include "shared/bindings.h"
#include "shared/types.h"

#define QUADTREE_TOP 7 /* the paper has at most nine levels besides the root */
#define QUADTREE_SIDE 128u
#define QUADTREE_FACES_MAX 6u
#define QUADTREE_LAYERS_MAX 3u
#define QUADTREE_SLOPE_SCALE 1024.0f
#define QUADTREE_SLOPE_MAX 65504.0f /* maximum of half floats, after the scale */

/* Uniforms of every pass of the tracer; a std140 block. */
struct quadtree_uniforms {
    vec4 face_from_world[18]; /* three rows a face: right, down, forward, of unit length */
    vec4 eye_world;           /* w: radius of the sphere round it within which other eyes may be, metres */
    vec4 scale_centre;        /* xy: texels per unit of X / Z, or of X; zw: centre, on the axis of the view */
    vec4 depths; /* x: the unit, the distance at which w is 1, metres, or near if orthographic; y: far,
                    beyond which there are only discs; z: 1 if orthographic; w: near */
    /* x: maximum difference of w between a plane over several texels and the surface, for an eye far from it:
     * unit pixels / (f radius); y: cosine of the maximum angle between it and its children's planes, 0: any; z:
     * w at the distance where both are doubled, 0: they do not grow; w: radius / unit, of the sphere of eyes
     * for which x holds */
    vec4 bounds;
    uint width, height; /* size of a face, texels */
    uint padded_width, padded_height;
    uint faces, layers;
    uint slice_nodes; /* nodes of a slice */
    uint pad0;
};
SHARED_SIZE(quadtree_uniforms, 384)

/* Counts of the rays of one kind in a frame. */
struct quadtree_counts {
    uint rays;
    /* Shadow rays that do not end behind the first layer count here too if they passed gaps and may have been
     * behind it there. */
    uint behind_first, behind_second; /* rays that were somewhere behind the first layer, or the second */
    uint behind_last;                 /* rays that found nothing before they were behind the last layer */
    uint outside;                     /* rays that found nothing in the view, and left it */
    uint pad0, pad1, pad2;
};
SHARED_SIZE(quadtree_counts, 32)
#define QUADTREE_KINDS 4 /* kinds of rays; behind their counts in the buffer are those of eyes.comp: */
/* Indices of counts, by number of rays: 1 or 2 for rays of eyes that came behind that many layers, and those
 * below. Rays that meet the first layer are too many to be counted. */
#define QUADTREE_DEAD 3u /* beyond the picture's edge */
#define QUADTREE_BEHIND 4u
#define QUADTREE_OUTSIDE 8u
#define QUADTREE_OUTCOMES 12

/* Distance in texels within which a ray may pass the extension of a plane beside the surface that it began on,
 * and within which a ray behind a plane may come before the next one again: half a texel, and its diagonal's. */
#define QUADTREE_OWN_WAY 1.5f
/* Texels: primitives narrower than this may lie between the middles of texels, and be missed. */
#define QUADTREE_FINE 2.0f
#define QUADTREE_DEEP 0.05f /* share of w behind a plane from which a ray is behind the surface */

/* Maximum distance, in bounds of w, between a plane and another one's extension through a texel; and the maximum
 * factor by which this may increase the distance of the farthest surface. */
#define QUADTREE_PLANES_APART 2.0f
#define QUADTREE_FARTHER_MAX 16.0f
/* Share of its way through the view at which a ray that was before nothing counts as ended. */
#define QUADTREE_ALMOST_END 0.999f

/* Result of beams.comp for a tile: the level at which its rays begin, and whether all of them begin in the
 * view. */
#define QUADTREE_BEAM_LEVEL 7
#define QUADTREE_BEAM_INSIDE 8

/* Distance within which the space before a view with one face counts as empty, in radii of the view's eye: an
 * eye beside its own looks past the view's edge, until its rays enter the view. Farther away that space is
 * unknown. For an eye s aside, and a view whose outermost ray has the tangent t, a ray with the tangent a
 * enters at s sqrt(1 + t^2) / (t - a) from the view's eye. With 8, which is 1.2 m for the usual radius, an eye
 * 65 mm aside sees all of its picture in a view 16 to 9 of 50 degrees with the usual margin, at 1.06 m; both
 * eyes of a pair do down to 20 degrees. */
#define QUADTREE_FREE_RADII 8.0f

#define BIND_QUADTREE_COUNTS BIND_TRACER_0
#define UNIFORM_QUADTREE 3
#define UNIT_QUADTREE_VISIBLE UNIT_TRACER_0
#define UNIT_QUADTREE_NODES UNIT_TRACER_1
#define UNIT_QUADTREE_BEAMS UNIT_TRACER_5
#define UNIT_QUADTREE_DEPTH UNIT_TRACER_2 /* depth of the layer before the current one */
/* Passes that build: the leaves of one slice as planes without flags; for all slices the levels above: the
 * maximum distance of a plane from those of its leaves. */
#define UNIT_QUADTREE_PLANES UNIT_TRACER_3
#define UNIT_QUADTREE_ERRORS UNIT_TRACER_4
#define IMAGE_QUADTREE_NODES 0
#define IMAGE_QUADTREE_PLANES 1
#define IMAGE_QUADTREE_ERRORS 2
#define IMAGE_QUADTREE_BEAMS 0

/* Two adjacent texels show surfaces that continue one another if their planes differ by at most this share of w
 * plus bounds.x, in the middle of their common border. Prototypes had cracks up to it. */
#define QUADTREE_EDGE_SHARE 0.001953125f
/* Maximum factor by which the tolerance may grow with distance. */
#define QUADTREE_GROWTH_MAX 4.0f

#endif
