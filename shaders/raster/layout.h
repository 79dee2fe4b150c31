/* SPDX-License-Identifier: MIT */
/* Instances rasterised along the three axes of the world, into three images at once (raster/draw.*): shared by the
 * tracers that are built this way.
 *
 * A drawn primitive has an id, by which the primitives of all instances are numbered. Ids ascend with instances,
 * and within an instance with primitives.
 *   drawn   RGBA32UI, one per instance: first id; id minus the primitive's scene-wide number; the instance;
 *           DRAWN_* */
#ifndef FARLIGHT_SHADERS_RASTER_LAYOUT_H
#define FARLIGHT_SHADERS_RASTER_LAYOUT_H

/* Share of a normal's largest component: a surface leans to every axis whose component is at least this. */
#define AXES_OVERLAP 0.85f

#define DRAWN_NORMALS 1u /* the instance's vertices have such attributes */
#define DRAWN_COLOURS 2u
#define DRAWN_SPHERES 4u
#define DRAWN_MIRRORED 8u
#define DRAWN_CLOSED 16u /* the mesh bounds a body without cutouts */

/* Orientation of a triangle to the axes, and its kind, in a word. */
#define FACE_NORMAL_MASK 0x00ffffffu /* octahedral 2 x 12 bit snorm, world space, to the outside */
/* Shifted by the axis: the triangle leans to it as much as to any, or almost. */
#define FACE_LEANS 0x01000000u
#define FACE_STEEP 0x08000000u    /* shifted by the axis: the normal's component is below FACE_STEEP_BELOW */
#define FACE_DOMINANT 0x40000000u /* the image is that of the dominant axis, the first of equal ones */
#define FACE_CLOSED 0x80000000u   /* DRAWN_CLOSED */
#define FACE_NEEDLE 0x3f000000u   /* the triangle has no normal: steep, and leaning to every axis */
#define FACE_STEEP_BELOW 0.5f     /* component of a unit normal */

/* clang-format off */
/* A grid of blocks, row after row, by which a ray skips empty space. The first texel of a block, RGBA32UI:
 *   x, y  bits of the occupied ones among its 4 x 4 x 4 parts: x + 4 y + 16 z
 *   z     empty block: 8 x 4 bits, for the octants of a direction (bit 0, 1, 2: x, y, z descend): the side, in blocks,
 *         of the empty cube that begins with this block and extends along the octant. Occupied block: the tracer's own
 *   w     during the build: empty blocks along x (2 x 4 bits), then empty squares in x and y (4 x 4 bits) */
/* clang-format on */
#define BLOCK_REACH_MAX 15u
#define IMAGE_BLOCKS 0 /* raster/reach.comp */

#endif
