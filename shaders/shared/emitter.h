/* SPDX-License-Identifier: MIT */
/* Emissive triangles of the visible instances, in a tree by which one of them is chosen for a point
 * (shaders/common/emitter.glsl). Tables of shared/tables.h. */
#ifndef FARLIGHT_SHARED_EMITTER_H
#define FARLIGHT_SHARED_EMITTER_H
#include "shared/types.h"

/* Second and third texel of the tables: where the tables of emitters begin. */
struct emitter_starts {
    uint nodes, leaves, runs, shares; /* shares: four per texel */
    uint run_count;
    uint cluster_size; /* consecutive triangles of a run that form a leaf; the last leaf has the rest */
    float area;        /* sum over all emitters, world space, each weighted by its texture */
    uint pad0;
};
SHARED_SIZE(emitter_starts, 32)

/* Node of the tree. The first one is the root; the two children of a node lie side by side. Both sides of a
 * surface shine, so a normal and its opposite count as one. */
struct emitter_node {
    vec4 centre_radius; /* a sphere round it, world space */
    uint axis;          /* axis of the cone of its normals, octahedral, 2 x 16 bit snorm */
    float cos_spread;   /* cosine of the cone's half angle */
    float power;        /* sum over r, g, b of radiance times area */
    uint link;          /* first child; with EMITTER_LEAF a leaf */
};
SHARED_SIZE(emitter_node, 32)
#define EMITTER_NODE_TEXELS 2u
#define EMITTER_LEAF 0x80000000u

struct emitter_leaf {
    uint instance;
    uint first_primitive, count; /* scene-wide triangles */
    uint first_share; /* in the shares: the end of each triangle's share of the leaf, up to 1; only where
                         cluster_size is above 1 */
    uint trail;       /* way from the root: bit 0 is the first choice, 1 the second child */
    uint pad0, pad1, pad2;
};
SHARED_SIZE(emitter_leaf, 32)
#define EMITTER_LEAF_TEXELS 2u
#define EMITTER_DEPTH_MAX 32

/* Consecutive triangles of an instance with one emissive material; ordered by instance, then by primitive. */
struct emitter_run {
    uint instance;
    uint first_primitive, count;
    uint first_leaf;
};
SHARED_SIZE(emitter_run, 16)
#define EMITTER_RUN_TEXELS 1u

#endif
