/* SPDX-License-Identifier: MIT */
/* The parts of the NFF reader: nff.c parses statements, nff_shapes.c triangulates them. */
#ifndef FARLIGHT_IMPORT_NFF_H
#define FARLIGHT_IMPORT_NFF_H

#include "grouping.h"

#define NFF_CONE_SEGMENTS 32
#define NFF_TRIANGLES_MAX (1u << 27)

/* Arrays that grow while the file is read; malloc'd. */
struct nff_shapes {
    struct import_scene *scene;
    float *positions, *normals;
    size_t vertex_count, vertex_capacity;
    uint32_t *indices, *triangle_materials;
    size_t triangle_count, triangle_capacity;
    float *spheres;
    uint32_t *sphere_materials;
    size_t sphere_count, sphere_capacity;
    uint64_t polygon_budget;
    uint32_t material; /* of what comes next */
    float lower[3], upper[3];
};

/* Each false: the scene has failed. `where` names the line. */
bool nff_add_sphere(struct nff_shapes *shapes, const float centre[3], float radius);
/* Corners (3 floats each), with normals (likewise) for a patch or NULL for a flat polygon. */
bool nff_add_polygon(struct nff_shapes *shapes, const float *corners, const float *normals, uint32_t count,
                     const char *where);
/* Open at both ends; `ends` are base x y z radius, apex x y z radius. */
bool nff_add_cone(struct nff_shapes *shapes, const float ends[8], const char *where);
/* A platonic solid of 4, 6, 8 or 12 faces around a centre. */
bool nff_add_solid(struct nff_shapes *shapes, int faces, const float centre[3], float radius, const char *where);
/* Hands all over to the scene. */
bool nff_finish_shapes(struct nff_shapes *shapes);
void nff_free_shapes(struct nff_shapes *shapes);

#endif
