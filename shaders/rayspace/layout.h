/* SPDX-License-Identifier: MIT */
/* A hierarchy over the rays of a wave, and the pairs that descend it. Roger, Assarsson, Holzschuch, Whitted
 * Ray-Tracing for Dynamic Scenes using a Ray-Space Hierarchy on the GPU, EGSR 2007. */
#ifndef FARLIGHT_SHADERS_RAYSPACE_LAYOUT_H
#define FARLIGHT_SHADERS_RAYSPACE_LAYOUT_H
#include "shared/types.h"

/* A bundle of rays (section 3.2): the cone-sphere of the paper, beside it exact boxes. World space; directions are
 * taken as unit vectors, whatever those of the rays are. Node i of level n holds the nodes 4 i .. 4 i + 3 of level
 * n - 1. Level 0 is the rays themselves and is not stored; levels 1, 2, .. lie behind one another. RGBA32F. */
struct rayspace_node {
    vec4 centre_radius;          /* of the origins */
    vec4 axis_secant;            /* 1 / cosine of the spread; 0: there is no cone, only the boxes hold */
    vec4 origin_lower_tan;       /* tangent of the spread */
    vec4 origin_upper_end;       /* the greatest distance of interest of any ray; negative: all are dead */
    vec4 direction_lower_spread; /* the spread, radians */
    vec4 direction_upper;
};
SHARED_SIZE(rayspace_node, 96)
#define RAYSPACE_NODE_TEXELS 6
#define RAYSPACE_LEVELS 16 /* at most */
#define RAYSPACE_NODE_CHILDREN 4u

/* A pair of a node and an element of the scene that it may meet. RGBA32UI. Words:
 *   x  node: level, and its number in the level
 *   y  joint descent: element of the tree over the instance, or of the top tree; flat: item of the batch
 *   z  instance, RAYSPACE_TOP: the top tree
 *   w  joint descent: how many children of the element have been tested; the rest is to be
 * A pair of a ray and a leaf, or of a ray and a small part of a tree:
 *   x  ray;  y  joint descent: element; flat: item;  z  instance;
 *   then, once it was tested, z: rank of the nearest primitive, w: its distance, as ordered_bits() */
#define RAYSPACE_LEVEL_SHIFT 27u
#define RAYSPACE_INDEX_MASK 0x07ffffffu
#define RAYSPACE_TOP 0xffffffffu
#define RAYSPACE_PAIR_BYTES 16u
#define RAYSPACE_CHUNK 4u    /* pairs of an invocation */
#define RAYSPACE_CHILDREN 4u /* of a pair in a pass: nodes, or elements; more elements wait for the next pass */

/* Elements of a part of a tree that a ray goes through alone, at most: what a dispatch takes has a bound, and
 * software GL leaves a loop after 65535 rounds. */
#define RAYSPACE_SUBTREE_MAX 8192u

/* A primitive of an instance has a rank: by the number of the instance, then by its own. Of surfaces at one
 * distance the first by rank is hit. */
#define RAYSPACE_NO_RANK 0xffffffffu

/* What is known of a ray. Closest hit:
 *   x  the nearest distance so far, as ordered_bits(); y  the least rank at it among the leaves in hand;
 *   z, w  the distance and rank of the nearest hit of all leaves that are settled
 * Any hit: x, y, z  optical depth in steps (common/optical_depth.glsl). */
#define RAYSPACE_ANSWER_BYTES 16u

/* A primitive of a batch of the flat descent, RGBA32UI, most words bits of floats: bounding sphere; lower corner
 * of the box, and the instance; upper corner, and the primitive's number in its geometry. */
#define RAYSPACE_ITEM_TEXELS 3

/* Two stacks of pairs: a pass takes pairs from the top of one, and puts their children onto the other. What did
 * not fit is as if it had not happened: the next pass takes half as many. */
#define RAYSPACE_STACKS 2u
struct rayspace_control {
    uint waiting_0, waiting_1;    /* pairs on each stack */
    uint leaves;                  /* pairs of rays and leaves that wait */
    uint taken, first;            /* pairs of the pass in hand: first .. first + taken - 1 of its stack */
    uint written, leaves_written; /* by it; more than there is room for: they were not stored */
    uint room, leaves_room;       /* for them */
    uint limit;                   /* pairs of a pass at most */
    uint leaves_taken;            /* leaves to be tested before the pass in hand */
    uint pass_groups_x, pass_groups_y, pass_groups_z; /* arguments of indirect dispatches */
    uint leaf_groups_x, leaf_groups_y, leaf_groups_z;
    uint sort_groups_x, sort_groups_y, sort_groups_z;
    uint turned, sorted;             /* what a sample of the rays has decided */
    uint cone_tests, triangle_tests; /* so far; boxes that rays alone were tested against count as cones */
    uint pairs_max, passes, halvings;
    uint left_over;      /* not 0: some batch was not traced to its end */
    uint failed_in_turn; /* passes, up to the last one */
    uint pad0, pad1, pad2;
};
SHARED_SIZE(rayspace_control, 128)

/* Of the waves of one kind in a frame, with those that were done again. Sums of tests have 64 bits. */
struct rayspace_counts {
    uint waves, sorted, turned; /* waves with rays; those of which the rays were sorted; turned round */
    uint passes, halvings;
    uint pairs_max; /* of any wave */
    uint rays_low, rays_high;
    uint cone_tests_low, cone_tests_high;
    uint triangle_tests_low, triangle_tests_high;
};
SHARED_SIZE(rayspace_counts, 48)

/* After which pass control.comp runs: no other one is taken yet. Of a batch or of the wave, what then waits is
 * left over, and stops the slice. */
#define RAYSPACE_END_NOTHING 0u
#define RAYSPACE_END_BATCH 1u
#define RAYSPACE_END_WAVE 2u

#define BIND_RAYSPACE_CONTROL BIND_TRACER_0
#define BIND_RAYSPACE_PAIRS BIND_TRACER_1 /* of the stack that is written to */
#define BIND_RAYSPACE_LEAVES BIND_PASS_2
#define BIND_RAYSPACE_ANSWERS BIND_PASS_3
#define BIND_RAYSPACE_NODES BIND_PASS_4   /* of the pass that makes them */
#define BIND_RAYSPACE_STOPPED BIND_PASS_4 /* of control.comp */
#define BIND_RAYSPACE_COUNTS BIND_PASS_4  /* of count.comp */
#define BIND_RAYSPACE_ORDER BIND_PASS_4   /* of the sort */
#define BIND_RAYSPACE_BINS BIND_PASS_2
#define BIND_RAYSPACE_TIMES BIND_PASS_4 /* of tests of discs and leaves, whose texture units are few */
#define BIND_RAYSPACE_ITEMS BIND_PASS_4 /* of the pass that makes them */
/* of the tree: UNIT_TRACER_0 .. 2 */
#define UNIT_RAYSPACE_NODES UNIT_TRACER_3
#define UNIT_RAYSPACE_PAIRS UNIT_TRACER_4
#define UNIT_RAYSPACE_RANKS UNIT_TRACER_5 /* R32UI, of each instance its first primitive's */
#define UNIT_RAYSPACE_ITEMS UNIT_TRACER_6
#define UNIT_RAYSPACE_ORDER UNIT_TRACER_7 /* R32UI: which ray is at a place of level 0 */

/* Cells in which rays are sorted, by interleaved bits: of the origin in the scene's box, and of the direction on
 * the octahedron, which have one less. */
#define RAYSPACE_DIRECTION_BITS 3u
#define RAYSPACE_POSITION_BITS 4u
#define RAYSPACE_BINS (1u << (3u * RAYSPACE_POSITION_BITS + 2u * RAYSPACE_DIRECTION_BITS)) /* at most */
#define RAYSPACE_BINS_MIN 256u

#endif
