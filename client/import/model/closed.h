/* SPDX-License-Identifier: MIT */
/* Whether triangles bound a body. C and C++. */
#ifndef FARLIGHT_IMPORT_MODEL_CLOSED_H
#define FARLIGHT_IMPORT_MODEL_CLOSED_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* `positions` are 3 floats a vertex, `indices` 3 a triangle, all of them in range; a corner is the place where it
 * is (-0 is 0), whatever number it has, so that seams of normals and texture coordinates are none here. True:
 * - every edge has as many triangles that run along it one way as the other,
 * - no triangle is there both ways round: sheets that were given two sides, and parts that were simplified until
 * they had no thickness, bound nothing and would be lost,
 * - and not all triangles are degenerate. One that has two corners at one place is as if it were not there; one
 * whose corners lie on a line counts, as it closes the gap between a long edge and two short ones. Several bodies,
 * hollow ones and ones that run through each other are closed; which way round they are wound, inside or outside,
 * does not matter. Takes linear time, of large meshes on two threads, 8 bytes a vertex and 10 to 20 a triangle;
 * false where they are not to be had: open is what all meshes may be taken for. */
bool import_triangles_closed(const float *positions, uint32_t vertex_count, const uint32_t *indices,
                             uint32_t triangle_count);

#ifdef __cplusplus
}
#endif

#endif
