/* SPDX-License-Identifier: MIT */
/* A sparse voxel octree on the device: what its build (svo/voxelise.frag, svo/mark.comp, svo/allocate.comp,
 * svo/leaves.comp, svo/planes.comp) writes and the traversal (svo/traverse.glsl) reads.
 *
 * Crassin, Green. Octree-Based Sparse Voxelization Using the GPU Hardware Rasterizer. OpenGL Insights, 2012: one
 * pass of the rasteriser along each triangle's dominant axis lists the cells that hold something, then the tree is
 * made of the list, level by level from the root. Laine, Karras. Efficient Sparse Voxel Octrees. 2010: masks of
 * the children that there are, which lie side by side; leaves may have a plane, their contour.
 *
 * The root is a cube of SVO_SIDE cells a side. Two levels of nodes are one record: a node, its eight octants'
 * masks, and where their children begin. Half as many fetches lead to a leaf so.
 *
 *   records    RGBA32UI
 *                x, y  which of the 4 x 4 x 4 grandchildren hold something: bit x + 4 y + 16 z. The octants' masks
 * of eight are the bits of 2 x 2 x 2 in it z     the first of those in x, the others lie behind it in the order of
 * their bits w     the first of those in y Of the records of cells 4 wide these are leaves, of others records ids
 * R32UI, one a leaf: the primitive (raster/layout.h) of lowest id in it planes     R32UI, one a leaf: bits
 * 0..10, 11..21 average normal of what is in it, octahedral snorm; 22..31 the average distance of that along the
 * normal from the middle of the cell, SVO_PLANE_UNIT cells for 1. SVO_NO_PLANE: what is in it faces all ways
 *
 * Tiles: the tree as Crassin and Green have it, for comparison: nodes with pointers to tiles of eight children,
 * found anew from the root by each fragment at each level and by each ray in each step, and normals averaged leaf
 * by leaf. records    R32UI, one a node: bits 0..30 the first of its children, 0: none; SVO_HOLDS. Nodes of the
 * last level are leaves, whether they hold something or not planes     R32UI, one a leaf: average normal, unorm 3
 * x 8 bits, 0.5 for 0, and above them how many they are
 *
 * While it is built:
 *   fragments  RG32UI: bits 0..9, 10..19, 20..29 x, y, z; id. With planes or tiles RGBA32UI: z the geometric
 * normal, 2 x 16 bit octahedral snorm, w distance along it from the middle of the cell (float, cells) current
 * R32UI, one a fragment: the record that it has come to sums       R32I, four a leaf: normals, SVO_NORMAL_UNIT for
 * 1, then distances, SVO_DISTANCE_UNIT for a cell, times SVO_SUM_COUNT, plus their number */
#ifndef FARLIGHT_TESTS_BENCH_SVO_SVO_H
#define FARLIGHT_TESTS_BENCH_SVO_SVO_H
#include "shared/bindings.h"
#include "shared/types.h"

#define SVO_SIDE_MAX 1024 /* cells; a cell's place has 30 bits */
#define SVO_HOLDS 0x80000000u
#define SVO_EIGHT 0x00330033u /* 2 x 2 x 2 of 32 bits */
#define SVO_PLANE_BITS 11
#define SVO_PLANE_UNIT 0.001953125f /* 1 / 512 */
#define SVO_NO_PLANE 0x80000000u    /* a distance that no plane has */
#define SVO_NORMAL_UNIT 1024.0f
#define SVO_DISTANCE_UNIT 64.0f
#define SVO_SUM_COUNT 4096

/* Counted while it is built. */
struct svo_counts {
    uint fragments; /* all that there were, also where there was no room */
    uint children;  /* the next one that is free */
    uint pad0, pad1;
};
SHARED_SIZE(svo_counts, 16)

/* Bindings */
#define BIND_SVO_COUNTS BIND_TRACER_0
#define BIND_SVO_MARKS BIND_TRACER_1 /* the records, word by word */
#define IMAGE_SVO_FRAGMENTS 0        /* svo/voxelise.frag */
#define IMAGE_SVO_RECORDS 0          /* svo/allocate.comp */
#define IMAGE_SVO_CURRENT 1
#define IMAGE_SVO_IDS 2
#define IMAGE_SVO_SUMS 3
#define IMAGE_SVO_PLANES 4
#define UNIT_SVO_RECORDS 10
#define UNIT_SVO_IDS 11
#define UNIT_SVO_PLANES 12
#define UNIT_SVO_DRAWN 13
#define UNIT_SVO_FRAGMENTS 14

#endif
