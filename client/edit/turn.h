/* SPDX-License-Identifier: MIT */
/* A node's transform as values that people edit: translation, angles, scale. Pure. */
#ifndef FARLIGHT_CLIENT_EDIT_TURN_H
#define FARLIGHT_CLIENT_EDIT_TURN_H

/* Decomposes a 3x4 matrix, row by row, as in set_node. Scale is the lengths of the columns, x negative if the
 * matrix mirrors; angles are degrees about x, then y, then z, as in shots, of the matrix without scale. A shear
 * is lost. */
void edit_turn_load(const float matrix[12], double degrees[3], double scale[3]);
/* Replaces everything but the translation. */
void edit_turn_store(float matrix[12], const double degrees[3], const double scale[3]);

#endif
