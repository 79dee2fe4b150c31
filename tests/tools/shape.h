/* SPDX-License-Identifier: MIT */
/* Triangle meshes made from formulas, for the bundled scenes. */
#ifndef FARLIGHT_TOOLS_SHAPE_H
#define FARLIGHT_TOOLS_SHAPE_H

#include <stdbool.h>
#include <stdint.h>

struct shape {
    float *positions, *normals; /* 3 a vertex */
    uint32_t *indices;          /* 3 a triangle, counter-clockwise from outside */
    uint32_t vertex_count, vertex_capacity;
    uint32_t index_count, index_capacity;
    bool out_of_memory; /* sticky; the shape is then incomplete */
};

void shape_finish(struct shape *shape);

/* Corners in counter-clockwise order as seen from the side that the normal points to. */
void shape_quad(struct shape *shape, const float a[3], const float b[3], const float c[3], const float d[3]);
/* An axis-aligned box, turned by `turn` radians about +y through its centre. */
void shape_box(struct shape *shape, const float centre[3], const float half_size[3], float turn);
void shape_sphere(struct shape *shape, const float centre[3], float radius, uint32_t segments);
/* Body of revolution about +y: `profile` holds radius and height pairs from the bottom up. Flat at its ends. */
void shape_lathe(struct shape *shape, const float (*profile)[2], uint32_t profile_count, uint32_t segments);
/* A tube along a path of two and more centres with a radius each. Flat at its ends. */
void shape_tube(struct shape *shape, const float (*path)[3], const float *radii, uint32_t path_count,
                uint32_t segments);
/* On its foot at the origin, its spout towards +x, about 1.2 high and 2.8 long. */
void shape_teapot(struct shape *shape, uint32_t segments);

#endif
