/* SPDX-License-Identifier: MIT */
/* Keyed numbers over time: shared by the channels of clips and the keys of a camera. Pure. */
#ifndef FARLIGHT_SCENE_CURVE_H
#define FARLIGHT_SCENE_CURVE_H

#include "scene/scene.h"

#include <stddef.h>
#include <stdint.h>

#define CURVE_WIDTH_MAX 1024

/* Borrowed arrays. Times ascend strictly; everything is finite. With cubic spline and bezier a key has three
 * values of `width` numbers in a row: incoming tangent or control value, the key's own value, outgoing tangent or
 * control value. */
struct curve {
    const float *times, *values;
    size_t time_stride, key_stride; /* floats from one key to the next */
    uint32_t key_count;             /* at least 1 */
    uint32_t width;                 /* numbers of a value, at most CURVE_WIDTH_MAX */
    enum interpolation interpolation;
};

/* Before the first key and after the last it stands still. */
void curve_at(const struct curve *curve, double time_s, double *value);
/* The same for a unit quaternion x y z w (width 4): linear is slerp along the shorter arc, Catmull-Rom takes of
 * each key the sign that is nearer to its neighbour; the result is made unit. */
void curve_rotation_at(const struct curve *curve, double time_s, double rotation[4]);
/* How far a rotation turns at most from one time to a later one, radians: the arcs between its keys. INFINITY
 * where that is not known: of splines, and of more than a few keys. */
double curve_turn_bound(const struct curve *curve, double from_s, double to_s);

#endif
