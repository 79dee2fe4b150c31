/* SPDX-License-Identifier: MIT */
/* Instances rasterised along the three axes of the world, into three images at once (axes/draw.*): what tracers
 * share that are built so.
 *
 * A drawn primitive has an id: primitives of all instances are counted through, in the order of the instances. Ids
 * ascend as instances and primitives do.
 *   drawn   RGBA32UI, one an instance: first id; what is added to a primitive's scene-wide number to make its id;
 *           the instance; DRAWN_* */
#ifndef FARLIGHT_SHADERS_RASTER_LAYOUT_H
#define FARLIGHT_SHADERS_RASTER_LAYOUT_H

/* Of the greatest component of a normal: a surface leans to every axis to which it leans as much as this. */
#define AXES_OVERLAP 0.85f

#define DRAWN_NORMALS 1u /* what its vertices have */
#define DRAWN_COLOURS 2u
#define DRAWN_SPHERES 4u
#define DRAWN_MIRRORED 8u
#define DRAWN_CLOSED 16u /* it bounds a body, of which nothing is cut out */

/* How a triangle lies to the axes, and what it is of, in a word. */
#define FACE_NORMAL_MASK 0x00ffffffu /* octahedral 2 x 12 bit snorm, world space, to the outside */
#define FACE_LEANS 0x01000000u       /* times 2 to the axis: as much as to any, or almost */
#define FACE_STEEP 0x08000000u       /* times 2 to the axis: the normal's component is below FACE_STEEP_BELOW */
#define FACE_MOST 0x40000000u        /* this is the image that it leans to most, of equal ones the first */
#define FACE_CLOSED 0x80000000u      /* DRAWN_CLOSED */
#define FACE_NEEDLE 0x3f000000u      /* it has no normal: steep and leaning every way */
#define FACE_STEEP_BELOW 0.5f        /* of a unit normal */

/* clang-format off */
/* A grid of blocks, row after row, by which a ray passes what is empty. Of a block the first texel, RGBA32UI:
 *   x, y  which of its 4 x 4 x 4 parts hold something: bit x + 4 y + 16 z
 *   z     of an empty block: 8 x 4 bits, for the octants of a direction (bit 0, 1, 2: x, y, z run down): so many blocks
 *         along each side of a cube that begins with this one and reaches that way are empty. Of others what the
 *         tracer needs
 *   w     while they are made: what is empty along x (2 x 4 bits), then of squares in x and y (4 x 4 bits) */
/* clang-format on */
#define BLOCK_REACH_MAX 15u
#define IMAGE_BLOCKS 0 /* raster/reach.comp */

#endif
