/* SPDX-License-Identifier: MIT */
/* A node's transform as three values that people change: translation, angles, scale. Pure. */
#ifndef FARLIGHT_CLIENT_EDIT_TURN_H
#define FARLIGHT_CLIENT_EDIT_TURN_H

/* Of a 3x4 matrix, row by row, as set_node has it. Scale is the lengths of the columns, x negative where the
 * matrix mirrors; angles are degrees about x, then y, then z, as in the shots of animations, of what is left when
 * the scale is taken out. A shear is no part of them. */
void edit_turn_load(const float matrix[12], double degrees[3], double scale[3]);
/* Leaves the translation, and replaces the rest. */
void edit_turn_store(float matrix[12], const double degrees[3], const double scale[3]);

#endif
