/* SPDX-License-Identifier: MIT */
/* Affine transforms: 3x4, row-major, as the protocol has them, but in double precision. */
#ifndef FARLIGHT_IMPORT_MODEL_PLACEMENT_H
#define FARLIGHT_IMPORT_MODEL_PLACEMENT_H

struct placement {
    double m[12];
};

struct placement placement_identity(void);
/* First `scale`, then a rotation by the unit quaternion x y z w, then `translation`. */
struct placement placement_from_parts(const double scale[3], const double rotation[4],
                                      const double translation[3]);
/* The unit quaternion of a turn about an axis of any length; no turn if the axis is 0. */
void placement_turn(const double axis[3], double degrees, double rotation[4]);
/* a after b. */
struct placement placement_product(const struct placement *a, const struct placement *b);
void placement_to_floats(const struct placement *a, float out[12]);

#endif
