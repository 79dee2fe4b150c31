/* SPDX-License-Identifier: MIT */
/* Kochanek-Bartels splines (D. Kochanek and R. Bartels. Interpolating Splines with Local Tension, Continuity, and
 * Bias Control. SIGGRAPH 1984), as BART's animations use them: tangents are adjusted for keys that are not evenly
 * spaced, and rotations are interpolated by squad (K. Shoemake. Animating Rotation with Quaternion Curves.
 * SIGGRAPH 1985) with the same tangents, of the quaternions' logarithms.
 *
 * The first and the last key only shape the tangents of their neighbours: the curve runs from the second to the
 * last but one, and is constant before and after. */
#ifndef FARLIGHT_IMPORT_SPLINE_H
#define FARLIGHT_IMPORT_SPLINE_H

#include <stddef.h>

#define SPLINE_KEYS_MIN 4

struct spline_key {
    double time;
    double value[4]; /* x y z; or a unit quaternion x y z w */
    double tension, continuity, bias;
};

/* Derivatives by time at the curve's key i, 1 to count - 2: of what comes to it and of what leaves it. */
void spline_tangents(const struct spline_key *keys, size_t i, double incoming[3], double outgoing[3]);
/* `speed` is its derivative by time within the segment that begins at or before `time`; may be NULL. */
void spline_position(const struct spline_key *keys, size_t count, double time, double out[3], double speed[3]);

/* Turns the signs of quaternions so that each is on its predecessor's side: turns take the shorter way. */
void spline_align(struct spline_key *keys, size_t count);
/* `keys` are aligned. */
void spline_rotation(const struct spline_key *keys, size_t count, double time, double out[4]);
/* Between two rotations at the share t, on the shortest arc of their quaternions. */
void spline_slerp(const double a[4], const double b[4], double t, double out[4]);

#endif
