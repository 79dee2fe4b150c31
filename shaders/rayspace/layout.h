/* SPDX-License-Identifier: MIT */
/* Hierarchy over the rays of a wave, and the pairs that descend it. Roger, Assarsson, Holzschuch, Whitted
 * Ray-Tracing for Dynamic Scenes using a Ray-Space Hierarchy on the GPU, EGSR 2007. */
#ifndef FARLIGHT_SHADERS_RAYSPACE_LAYOUT_H
#define FARLIGHT_SHADERS_RAYSPACE_LAYOUT_H
#include "shared/types.h"

/* A bundle of rays (section 3.2): the cone-sphere of the paper, beside it exact boxes. World space; directions
 * count as unit vectors, whatever length the rays' have. Node i of level n holds the nodes 4 i .. 4 i + 3 of level
 * n - 1. Level 0 is the rays themselves and is not stored; levels 1, 2, .. follow one another. RGBA32F. */
struct rayspace_node {
    vec4 centre_radius;          /* sphere round the origins */
    vec4 axis_secant;            /* 1 / cosine of the spread; 0: no cone, only the boxes are valid */
    vec4 origin_lower_tan;       /* tangent of the spread */
    vec4 origin_upper_end;       /* maximum distance that matters to any ray; negative: every ray is dead */
    vec4 direction_lower_spread; /* the spread, radians */
    vec4 direction_upper;
};
SHARED_SIZE(rayspace_node, 96)
#define RAYSPACE_NODE_TEXELS 6
#define RAYSPACE_LEVELS 16 /* maximum */
#define RAYSPACE_NODE_CHILDREN 4u

/* A pair of a node and an element of the scene that it may meet. RGBA32UI. Words:
 *   x  node: level, and its number in the level
 *   y  joint descent: element of the tree over the instance, or of the top tree; flat: item of the batch
 *   z  instance, RAYSPACE_TOP: the top tree
 *   w  joint descent: number of the element's children that have been tested
 * A pair of a ray and a leaf, or of a ray and a small part of a tree:
 *   x  ray;  y  joint descent: element; flat: item;  z  instance;
 *   after the test, z: rank of the nearest primitive, w: its distance, as ordered_bits() */
#define RAYSPACE_LEVEL_SHIFT 27u
#define RAYSPACE_INDEX_MASK 0x07ffffffu
#define RAYSPACE_TOP 0xffffffffu
#define RAYSPACE_PAIR_BYTES 16u
#define RAYSPACE_CHUNK 4u /* pairs per invocation */
#define RAYSPACE_CHILDREN                                                                                         \
    4u /* per pair in a pass: nodes, or elements; further elements wait for the next pass                         \
        */

/* Maximum of elements in a part of a tree that a ray traverses alone: it bounds a dispatch, and software GL
 * leaves a loop after 65535 rounds. */
#define RAYSPACE_SUBTREE_MAX 8192u

/* Rank of a primitive of an instance: ordered by the number of the instance, then by its own. Among surfaces at
 * one distance the first by rank is hit. */
#define RAYSPACE_NO_RANK 0xffffffffu

/* Answer for a ray so far. Closest hit:
 *   x  the nearest distance so far, as ordered_bits(); y the minimum rank at it among the current leaves; z, w
 *      distance and rank of the nearest hit of all settled leaves
 * Any hit: x, y, z  optical depth in steps (common/optical_depth.glsl). */
#define RAYSPACE_ANSWER_BYTES 16u

/* A primitive of a batch of the flat descent, RGBA32UI, most words bits of floats: bounding sphere; lower corner
 * of the box, and the instance; upper corner, and the primitive's number in its geometry. */
#define RAYSPACE_ITEM_TEXELS 3

/* Two stacks of pairs: a pass takes pairs from the top of one, and pushes their children onto the other. A pass
 * whose output does not fit has no effect: the next one takes half as many. */
#define RAYSPACE_STACKS 2u
struct rayspace_control {
    uint waiting_0, waiting_1;    /* pairs on each stack */
    uint leaves;                  /* pairs of rays and leaves that wait to be tested */
    uint taken, first;            /* pairs of the current pass: first .. first + taken - 1 of its stack */
    uint written, leaves_written; /* output of the pass; if greater than the room, it was not stored */
    uint room, leaves_room;       /* places for it */
    uint limit;                   /* maximum of pairs in a pass */
    uint leaves_taken;            /* leaves to be tested before the current pass */
    uint pass_groups_x, pass_groups_y, pass_groups_z; /* arguments of indirect dispatches */
    uint leaf_groups_x, leaf_groups_y, leaf_groups_z;
    uint sort_groups_x, sort_groups_y, sort_groups_z;
    uint turned, sorted;             /* decisions from a sample of the rays */
    uint cone_tests, triangle_tests; /* so far; boxes that rays alone were tested against count as cones */
    uint pairs_max, passes, halvings;
    uint left_over;      /* not 0: some batch was not traced to its end */
    uint failed_in_turn; /* consecutive failed passes, up to the last one */
    uint pad0, pad1, pad2;
};
SHARED_SIZE(rayspace_control, 128)

/* Counts of the waves of one kind in a frame, with repeated ones. Sums of tests have 64 bits. */
struct rayspace_counts {
    uint waves, sorted, turned; /* waves with rays; those with sorted rays; with reversed ones */
    uint passes, halvings;
    uint pairs_max; /* maximum over all waves */
    uint rays_low, rays_high;
    uint cone_tests_low, cone_tests_high;
    uint triangle_tests_low, triangle_tests_high;
};
SHARED_SIZE(rayspace_counts, 48)

/* Pass after which control.comp runs, with no other pass to follow. Pairs that then wait, of the batch or of
 * the wave, are left over, and stop the slice. */
#define RAYSPACE_END_NOTHING 0u
#define RAYSPACE_END_BATCH 1u
#define RAYSPACE_END_WAVE 2u

#define BIND_RAYSPACE_CONTROL BIND_TRACER_0
#define BIND_RAYSPACE_PAIRS BIND_TRACER_1 /* the stack that is written */
#define BIND_RAYSPACE_LEAVES BIND_PASS_2
#define BIND_RAYSPACE_ANSWERS BIND_PASS_3
#define BIND_RAYSPACE_NODES BIND_PASS_4   /* pass that makes the nodes */
#define BIND_RAYSPACE_STOPPED BIND_PASS_4 /* control.comp */
#define BIND_RAYSPACE_COUNTS BIND_PASS_4  /* count.comp */
#define BIND_RAYSPACE_ORDER BIND_PASS_4   /* passes of the sort */
#define BIND_RAYSPACE_BINS BIND_PASS_2
#define BIND_RAYSPACE_TIMES BIND_PASS_4 /* tests of discs and leaves, whose texture units are scarce */
#define BIND_RAYSPACE_ITEMS BIND_PASS_4 /* pass that makes the items */
/* Texture units; the tree has UNIT_TRACER_0 .. 2. */
#define UNIT_RAYSPACE_NODES UNIT_TRACER_3
#define UNIT_RAYSPACE_PAIRS UNIT_TRACER_4
#define UNIT_RAYSPACE_RANKS UNIT_TRACER_5 /* R32UI: rank of each instance's first primitive */
#define UNIT_RAYSPACE_ITEMS UNIT_TRACER_6
#define UNIT_RAYSPACE_ORDER UNIT_TRACER_7 /* R32UI: the ray at each place of level 0 */

/* Bits of the cells in which rays are sorted, interleaved: of the origin in the scene's box, and of the
 * direction on the octahedron, one less. */
#define RAYSPACE_DIRECTION_BITS 3u
#define RAYSPACE_POSITION_BITS 4u
/* Maximum of bins. */
#define RAYSPACE_BINS (1u << (3u * RAYSPACE_POSITION_BITS + 2u * RAYSPACE_DIRECTION_BITS))
#define RAYSPACE_BINS_MIN 256u

#endif
