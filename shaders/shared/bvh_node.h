/* SPDX-License-Identifier: MIT */
/* What the tracer `bvh` keeps on the device. Two levels: one tree over the primitives of each geometry, one top
 * tree over the instances; both of the same elements, walked by links alone (no stack).
 *
 * An element is stored once; beside it lie eight pairs of links, one for each sign of the direction's components,
 * so that every ray meets nearer children first. Octant o: bit 0: x is negative, 1: y, 2: z. A tree of n elements
 * that begins at element f has its elements at f .. f + n - 1 and the links of octant o at 8 f + o n .. Links
 * count from the tree's beginning; the walk begins at 0.
 *
 * Why not eight copies of the elements, in which "the bound is hit" is "go to the next": measured on software GL
 * with 146K and 871K triangles they are 5 to 9 % faster, and take 256 bytes an element against 96, which have to
 * be built and uploaded too. */
#ifndef FARLIGHT_SHARED_BVH_NODE_H
#define FARLIGHT_SHARED_BVH_NODE_H
#include "shared/types.h"

/* Two texels of an RGBA32UI texel buffer, or an entry of a storage buffer in the plain form.
 * Box: lower and upper corner. Sphere: centre in `lower`, radius in `upper_x`; y and z are 0. */
struct bvh_element {
    float lower_x, lower_y, lower_z;
    uint miss; /* the plain form's link: one order for all directions, in which a hit goes to the next element */
    float upper_x, upper_y, upper_z;
    uint leaf; /* 0: an inner element; else BVH_LEAF_* */
};
SHARED_SIZE(bvh_element, 32)
#define BVH_END 0xffffffffu /* a link: this tree is done */
#define BVH_OCTANTS 8u

/* A texel of an RG32UI texel buffer. */
struct bvh_link {
    uint hit, miss; /* a leaf goes on at `miss` either way */
};
SHARED_SIZE(bvh_link, 8)

/* A leaf: kind (2 bits), count - 1 (3 bits), first primitive in the tree's order or instance (27 bits). */
#define BVH_LEAF_KIND_SHIFT 30u
#define BVH_LEAF_TRIANGLES 1u
#define BVH_LEAF_SPHERES 2u
#define BVH_LEAF_INSTANCE 3u
#define BVH_LEAF_COUNT_SHIFT 27u
#define BVH_LEAF_COUNT_MASK 7u
#define BVH_LEAF_FIRST_MASK 0x07ffffffu
#define BVH_LEAF_MAX 8u /* primitives */

/* The other half of a transform element: what entering an instance does. Four texels of an RGBA32UI buffer. */
struct bvh_transform {
    vec4 object_from_world[3];
    uint first_element; /* of the geometry's tree, in the element buffer */
    uint element_count;
    uint first_texel;     /* of the geometry's primitives, in the primitive buffer */
    uint first_primitive; /* scene-wide */
};
SHARED_SIZE(bvh_transform, 64)
#define BVH_TRANSFORM_TEXELS 4

/* Primitives in the order of the leaves, fetched without an index in between. RGBA32UI, though most are floats: a
 * small integer is no float that a driver has to keep. Texels:
 *   triangle  3 texels: corners; w of the first: bits of the primitive's number in its geometry
 *   sphere    2 texels: centre and radius; x of the second: bits of the number */
#define BVH_TRIANGLE_TEXELS 3u
#define BVH_SPHERE_TEXELS 2u

#endif
