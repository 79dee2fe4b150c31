/* SPDX-License-Identifier: MIT */
/* Decomposition of a node's transform, so that clips can change a part of it. Private to scene/. */
#ifndef FARLIGHT_SCENE_LOCAL_TRANSFORM_H
#define FARLIGHT_SCENE_LOCAL_TRANSFORM_H

/* A transform: matrix = translation * turn * scale. */
struct local_transform {
    double translation[3];
    double turn[3][3]; /* by row; a rotation, if the matrix has no shear */
    double scale[3];
};

/* Decomposes a matrix. Translation is the last column, scale the lengths of the others, with x negated if the
 * matrix mirrors; rotation is the remainder, including a shear. */
void local_transform_from_matrix(struct local_transform *transform, const float matrix[12]);
void local_transform_set_rotation(struct local_transform *transform, const double unit_quaternion[4]);
/* Composes the matrix. Entries beyond 1e12, which the protocol excludes, become 1e12. */
void local_transform_to_matrix(const struct local_transform *transform, float matrix[12]);

#endif
