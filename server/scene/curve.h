/* SPDX-License-Identifier: MIT */
/* Keyed numbers over time: channels of clips and keys of a camera share them. Pure. */
#ifndef FARLIGHT_SCENE_CURVE_H
#define FARLIGHT_SCENE_CURVE_H

#include "scene/scene.h"

#include <stddef.h>
#include <stdint.h>

#define CURVE_WIDTH_MAX 1024

/* A curve; borrows its arrays. Times ascend strictly; all numbers are finite. In cubic splines and beziers a
 * key has three values of `width` numbers in a row: incoming tangent or control value, the key's own value,
 * outgoing tangent or control value. */
struct curve {
    const float *times, *values;
    size_t time_stride, key_stride; /* floats from one key to the next */
    uint32_t key_count;             /* at least 1 */
    uint32_t width;                 /* numbers per value, at most CURVE_WIDTH_MAX */
    enum interpolation interpolation;
};

/* Evaluates the curve; it is constant before the first key and after the last. */
void curve_at(const struct curve *curve, double time_s, double *value);
/* Evaluates a curve of unit quaternions x y z w (width 4): linear is slerp along the shorter arc, Catmull-Rom
 * uses the sign of each key that is nearer to its neighbour; the result is normalised. */
void curve_rotation_at(const struct curve *curve, double time_s, double rotation[4]);
/* Maximum angle by which a rotation turns between two times, radians: the arcs between its keys. INFINITY where
 * that is unknown: for splines, and for more than a few keys. */
double curve_turn_bound(const struct curve *curve, double from_s, double to_s);

#endif
