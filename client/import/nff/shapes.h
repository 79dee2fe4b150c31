/* SPDX-License-Identifier: MIT */
/* Triangles and spheres that a reader collects and then adds as one mesh and one set, for a format with single
 * shapes (NFF). */
#ifndef FARLIGHT_IMPORT_NFF_SHAPES_H
#define FARLIGHT_IMPORT_NFF_SHAPES_H

#include "import/model/grouping.h"

#define SHAPES_CONE_SEGMENTS 32
#define SHAPES_TRIANGLES_MAX (1u << 27)

struct shape_vertex {
    float position[3], normal[3];
};

/* Arrays that grow while the file is read; malloc'd. */
struct shapes {
    struct import_scene *scene;
    float *positions, *normals;
    size_t vertex_count, vertex_capacity;
    uint32_t *indices, *triangle_materials;
    size_t triangle_count, triangle_capacity;
    float *spheres;
    uint32_t *sphere_materials;
    size_t sphere_count, sphere_capacity;
    uint64_t *polygon_budget; /* shared by the whole file */
    uint32_t material;        /* material of the following shapes */
    float lower[3], upper[3];
};

void shapes_init(struct shapes *shapes, struct import_scene *scene, uint64_t *polygon_budget);
void shapes_free(struct shapes *shapes);

/* Reserves space for shapes. False from this function and those below: the scene has failed. `where` names the
 * line. */
bool shapes_reserve(struct shapes *shapes, size_t more_vertices, size_t more_triangles);
/* Add a vertex or a triangle, after a reservation. A normal need not have unit length. */
uint32_t shapes_add_vertex(struct shapes *shapes, const struct shape_vertex *vertex);
void shapes_add_triangle(struct shapes *shapes, uint32_t a, uint32_t b, uint32_t c);
bool shapes_add_sphere(struct shapes *shapes, const float centre[3], float radius);
/* Adds a polygon; `flat`: all corners share a normal. */
bool shapes_add_polygon(struct shapes *shapes, const struct shape_vertex *corners, uint32_t count, bool flat,
                        const char *where);
/* Adds a cone, open at both ends; `ends` are base x y z radius, apex x y z radius. */
bool shapes_add_cone(struct shapes *shapes, const float ends[8], const char *where);
/* Adds a platonic solid of 4, 6, 8 or 12 faces around a centre. */
bool shapes_add_solid(struct shapes *shapes, int faces, const float centre[3], float radius, const char *where);

/* Adds everything to the scene, below the root. Materials are numbered from 1 on; materials[i] is the
 * identifier of number i, 0: none. */
bool shapes_finish(struct shapes *shapes, const uint32_t *materials);

#endif
