/* SPDX-License-Identifier: MIT */
/* Grouping of triangles and spheres by material, for formats that switch materials as they go (OBJ, NFF), so
 * that each set has few ranges. */
#ifndef FARLIGHT_IMPORT_MODEL_GROUPING_H
#define FARLIGHT_IMPORT_MODEL_GROUPING_H

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Adds the mesh, whose ranges are made here from a material for each triangle, and a node below `parent` (0:
 * the root) that shows it; several of both if one would have too many ranges. Takes the mesh's arrays; it must
 * have neither morph targets nor joints. False: the scene has failed. */
bool import_add_grouped_mesh(struct import_scene *scene, uint32_t parent, struct import_mesh *mesh,
                             const uint32_t *materials);
/* Adds spheres, 4 floats each, and nodes in the same way; the arrays are not taken. */
bool import_add_grouped_spheres(struct import_scene *scene, uint32_t parent, const char *name,
                                const float *spheres, const uint32_t *materials, uint32_t count);

/* Divides a polygon of `count` corners (3 floats each) into count - 2 triangles and writes their corner
 * numbers; concave polygons by ear clipping. Convex, degenerate and twisted ones become a fan. `budget` limits
 * the work on concave polygons of a whole file: it is counted down, and once it is 0 they become fans, too, and
 * the result is false. */
bool polygon_triangulate(const float *corners, uint32_t count, uint32_t *triangles, uint64_t *budget);
#define POLYGON_CORNERS_MAX 65536u   /* division takes time proportional to its square */
#define POLYGON_BUDGET 2000000000ull /* a few seconds */

#ifdef __cplusplus
}
#endif

#endif
