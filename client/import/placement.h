/* SPDX-License-Identifier: MIT */
/* Affine transforms: 3x4, row-major, as the protocol has them, but in double precision. */
#ifndef FARLIGHT_IMPORT_PLACEMENT_H
#define FARLIGHT_IMPORT_PLACEMENT_H

#include <stdbool.h>

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
bool placement_is_identity(const struct placement *a);
/* Whether every element is at most `limit`; NaN is not. */
bool placement_within(const struct placement *a, double limit);
double placement_determinant(const struct placement *a);
/* Whether it keeps the shape of spheres, to a thousandth. */
bool placement_is_even(const struct placement *a);

void placement_point(const struct placement *a, const float in[3], float out[3]);
/* Of any length; outside stays outside where `a` mirrors. */
void placement_normal(const struct placement *a, const float in[3], float out[3]);
void placement_to_floats(const struct placement *a, float out[12]);

#endif
