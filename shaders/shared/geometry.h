/* SPDX-License-Identifier: MIT */
/* Geometry of the scene on the device, shared by all tracers. Bindings are in shared/bindings.h. */
#ifndef FARLIGHT_SHARED_GEOMETRY_H
#define FARLIGHT_SHARED_GEOMETRY_H
#include "shared/types.h"

/* An instance: a visible node with geometry. Matrices are rows of 3x4. */
struct instance {
    vec4 world_from_object[3];
    vec4 object_from_world[3];
    uint geometry; /* index into the geometries */
    uint node;     /* node id of the client */
    uint flags;    /* INSTANCE_* */
    uint motion;   /* index in `motions` of its first matrix over the shutter's time, plus 1; 0: it stands
                      still. Otherwise the matrices above are the first of them */
};
SHARED_SIZE(instance, 112)
#define INSTANCE_TEXELS 7       /* RGBA32UI */
#define MOTION_TEXELS 3         /* RGBA32F, a matrix in `motions` */
#define INSTANCE_MIRRORED 1u    /* negative determinant: winding is reversed */
#define INSTANCE_POSES_SHIFT 8u /* bits 8..11: number of those matrices, at even intervals of time */
#define INSTANCE_POSES_MASK 15u
#define INSTANCE_LIGHT_GROUP_SHIFT 12u /* bits 12..14: group of its emission; 0: none */
#define INSTANCE_LIGHT_GROUP_MASK 7u

/* A mesh or a set of spheres, stored once for all its instances. */
struct geometry {
    uint kind;            /* GEOMETRY_* */
    uint first_primitive; /* in `triangles` or `spheres` */
    uint primitive_count;
    uint first_vertex; /* meshes; indices in `triangles` are already scene-wide */
    uint vertex_count;
    uint flags;        /* GEOMETRY_HAS_* */
    uint close_offset; /* offset from a vertex at shutter open to the same one at shutter close; 0: the shape
                          does not change */
    uint pad0;
};
SHARED_SIZE(geometry, 32)
#define GEOMETRY_MESH 0u
#define GEOMETRY_SPHERES 1u
#define GEOMETRY_HAS_NORMALS 1u
#define GEOMETRY_HAS_TANGENTS 2u
#define GEOMETRY_HAS_TEXCOORDS_0 4u
#define GEOMETRY_HAS_TEXCOORDS_1 8u
#define GEOMETRY_HAS_COLOURS 16u
#define GEOMETRY_HAS_CUTOUT 32u /* some of its materials have alpha mode mask */
#define GEOMETRY_CLOSED 64u     /* its triangles bound a body */

/* Buffers, each a texel buffer:
 *   triangles   RGBA32UI  i0, i1, i2 (scene-wide vertex numbers), material index
 *   positions   RGBA32F   xyz object space, w unused
 *   normals     RGBA32F   xyz object space, w: handedness of the tangent (0: no tangent)
 *   tangents    R32UI     octahedral, 2 x 16 bit snorm, object space
 *   texcoords   RGBA32F   u0 v0 u1 v1
 *   colours     RGBA8     unorm, linear
 *   spheres     RGBA32F   centre xyz, radius, object space
 *   sphere_materials R32UI
 *   motions     RGBA32F   world_from_object of moving instances, 3 texels per pose; between poses entry by entry
 * The buffer of a vertex attribute that no mesh has is empty; attributes that one mesh lacks are zero and not
 * read. */

/* A disc: geometry outside every tree (the paper's PERFORMGLOBALGEOMETRYTESTS), world space. */
struct disc {
    vec4 centre_radius;
    vec4 normal; /* w unused */
    uint material, pad0, pad1, pad2;
};
SHARED_SIZE(disc, 48)

#endif
