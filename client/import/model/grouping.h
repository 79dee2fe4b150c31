/* SPDX-License-Identifier: MIT */
/* For formats that change the material as they go (OBJ, NFF): triangles and spheres are sorted by material,
 * so that each set has few ranges. */
#ifndef FARLIGHT_IMPORT_MODEL_GROUPING_H
#define FARLIGHT_IMPORT_MODEL_GROUPING_H

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Adds the mesh, whose ranges are made here from one material a triangle, and a node below `parent` (0: the root)
 * that shows it; several of both where one would have too many ranges. Takes the mesh's arrays, morph targets and
 * joints excepted, which it must not have. False: the scene has failed. */
bool import_add_grouped_mesh(struct import_scene *scene, uint32_t parent, struct import_mesh *mesh,
                             const uint32_t *materials);
/* Likewise for spheres, 4 floats each, which are not taken. */
bool import_add_grouped_spheres(struct import_scene *scene, uint32_t parent, const char *name,
                                const float *spheres, const uint32_t *materials, uint32_t count);

/* Cuts a polygon of `count` corners (3 floats each) into count - 2 triangles and writes their corner numbers;
 * concave ones by ear clipping. What is convex, degenerate or twisted becomes a fan. `budget` limits the work on
 * concave polygons of a whole file: it is counted down, and once it is 0 they become fans, too. Returns false for
 * such. */
bool polygon_triangulate(const float *corners, uint32_t count, uint32_t *triangles, uint64_t *budget);
#define POLYGON_CORNERS_MAX 65536u   /* cutting takes the square of it */
#define POLYGON_BUDGET 2000000000ull /* a few seconds */

#ifdef __cplusplus
}
#endif

#endif
