/* SPDX-License-Identifier: MIT */
/* Detection of meshes that enclose a volume. C and C++. */
#ifndef FARLIGHT_IMPORT_MODEL_CLOSED_H
#define FARLIGHT_IMPORT_MODEL_CLOSED_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* `positions` are 3 floats a vertex, `indices` 3 a triangle, all in range. A corner is identified by its
 * position (-0 is 0), not by its number, so that seams of normals and texture coordinates do not matter. True
 * if
 * - every edge has equally many triangles along it in both directions,
 * - no triangle occurs in both orientations: two-sided sheets, and parts that were simplified until they had no
 * thickness, enclose nothing and would be lost,
 * - and not all triangles are degenerate. A triangle with two corners at one position is ignored; one whose
 * corners lie on a line counts, as it closes the gap between a long edge and two short ones.
 * Several bodies, hollow ones and intersecting ones are closed, whatever their winding. Takes linear time, for
 * large meshes on two threads, and 8 bytes a vertex and 10 to 20 a triangle; without this memory the result is
 * false, which is safe for all meshes. */
bool import_triangles_closed(const float *positions, uint32_t vertex_count, const uint32_t *indices,
                             uint32_t triangle_count);

#ifdef __cplusplus
}
#endif

#endif
