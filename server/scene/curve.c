/* SPDX-License-Identifier: MIT */
/* Interpolation between keys: steps, lines, splines and rotations. */
#include "scene/curve.h"

#include <math.h>
#include <string.h>

static double time_at(const struct curve *curve, uint32_t key)
{
    return (double)curve->times[key * curve->time_stride];
}

static bool has_controls(const struct curve *curve)
{
    return curve->interpolation == INTERPOLATION_CUBIC_SPLINE || curve->interpolation == INTERPOLATION_BEZIER;
}

/* Own value of a key. In curves with controls the incoming one precedes it and the outgoing one follows. */
static const float *value_at(const struct curve *curve, uint32_t key)
{
    return curve->values + key * curve->key_stride + (has_controls(curve) ? curve->width : 0);
}

static void copy(const struct curve *curve, uint32_t key, double *value)
{
    const float *from = value_at(curve, key);
    for (uint32_t i = 0; i < curve->width; i++)
        value[i] = (double)from[i];
}

/* Key at or before a time between the first and the last. */
static uint32_t key_before(const struct curve *curve, double time_s)
{
    uint32_t low = 0, high = curve->key_count - 1;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (time_at(curve, middle) <= time_s)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Place of a time between two keys. */
struct span {
    uint32_t key; /* key before it */
    double seconds, share;
};

/* Finds the span of a time. False: the value is that of a single key, which is copied. */
static bool find_span(const struct curve *curve, double time_s, struct span *span, double *value)
{
    uint32_t last = curve->key_count - 1;
    if (!(time_s > time_at(curve, 0)) || !(time_s < time_at(curve, last))) {
        copy(curve, time_s > time_at(curve, 0) ? last : 0, value);
        return false;
    }
    span->key = key_before(curve, time_s);
    double from_s = time_at(curve, span->key);
    span->seconds = time_at(curve, span->key + 1) - from_s;
    span->share = (time_s - from_s) / span->seconds;
    if (curve->interpolation != INTERPOLATION_STEP)
        return true;
    copy(curve, span->key, value);
    return false;
}

/* Interpolates between two values, with their slopes times the length of the span. */
static double hermite(double from, double slope_from, double to, double slope_to, double t)
{
    double t2 = t * t, t3 = t2 * t;
    return (2 * t3 - 3 * t2 + 1) * from + (t3 - 2 * t2 + t) * slope_from + (3 * t2 - 2 * t3) * to +
           (t3 - t2) * slope_to;
}

static double bezier(double from, double leaving, double arriving, double to, double t)
{
    double u = 1 - t;
    return u * u * u * from + 3 * u * u * t * leaving + 3 * u * t * t * arriving + t * t * t * to;
}

/* Slope at a key: that of the line between its neighbours; at the ends, to the only neighbour. With keys at
 * equal distances this is the spline of Catmull and Rom (1974). */
static double slope_at(const struct curve *curve, uint32_t key, double before, double after)
{
    uint32_t previous = key ? key - 1 : key, next = key + 1 < curve->key_count ? key + 1 : key;
    return (after - before) / (time_at(curve, next) - time_at(curve, previous));
}

/* Interpolates a number between two keys; `sign` flips the four keys around them, the outer ones repeated at
 * the ends of the curve. */
static double catmull_rom(const struct curve *curve, const struct span *span, const double sign[4], uint32_t i)
{
    uint32_t key = span->key, last = curve->key_count - 1;
    double at[4];
    for (uint32_t k = 0; k < 4; k++) {
        uint32_t from = k == 0 ? (key ? key - 1 : 0) : key + k - 1;
        at[k] = sign[k] * (double)value_at(curve, from < last ? from : last)[i];
    }
    return hermite(at[1], slope_at(curve, key, at[0], at[2]) * span->seconds, at[2],
                   slope_at(curve, key + 1, at[1], at[3]) * span->seconds, span->share);
}

static void between_keys(const struct curve *curve, const struct span *span, const double sign[4], double *value)
{
    const float *from = value_at(curve, span->key), *to = value_at(curve, span->key + 1);
    uint32_t width = curve->width;
    for (uint32_t i = 0; i < width; i++) {
        double a = (double)from[i], b = (double)to[i];
        switch (curve->interpolation) {
        case INTERPOLATION_CUBIC_SPLINE:
            value[i] = hermite(a, (double)from[width + i] * span->seconds, b,
                               (double)(to - width)[i] * span->seconds, span->share);
            break;
        case INTERPOLATION_CATMULL_ROM:
            value[i] = catmull_rom(curve, span, sign, i);
            break;
        case INTERPOLATION_BEZIER:
            value[i] = bezier(a, (double)from[width + i], (double)(to - width)[i], b, span->share);
            break;
        case INTERPOLATION_STEP:
        case INTERPOLATION_LINEAR:
        case INTERPOLATION_COUNT:
            value[i] = a + (b - a) * span->share;
            break;
        }
    }
}

void curve_at(const struct curve *curve, double time_s, double *value)
{
    const double sign[4] = {1, 1, 1, 1};
    struct span span;
    if (find_span(curve, time_s, &span, value))
        between_keys(curve, &span, sign, value);
}

/* ---- rotations ---------------------------------------------------------------------------------- */

/* Normalises a quaternion; one of length 0 becomes no rotation. */
static void make_unit(double q[4])
{
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 0.0)) {
        memcpy(q, (double[4]){0, 0, 0, 1}, 4 * sizeof(*q));
        return;
    }
    for (int i = 0; i < 4; i++)
        q[i] /= length;
}

static void unit_key(const struct curve *curve, uint32_t key, double q[4])
{
    copy(curve, key, q);
    make_unit(q);
}

static double dot(const double a[4], const double b[4])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

/* Angle between two unit quaternions along the shorter arc: half the angle of the rotation. It is computed from
 * the lengths of sum and difference, which is exact for small angles too. */
static double arc_between(const double from[4], const double to[4], double sign)
{
    double sum = 0.0, difference = 0.0;
    for (int i = 0; i < 4; i++) {
        sum += (sign * to[i] + from[i]) * (sign * to[i] + from[i]);
        difference += (sign * to[i] - from[i]) * (sign * to[i] - from[i]);
    }
    return 2.0 * atan2(sqrt(difference), sqrt(sum));
}

static double shorter_sign(const double from[4], const double to[4])
{
    return dot(from, to) < 0.0 ? -1.0 : 1.0;
}

/* Shoemake, Animating rotation with quaternion curves, SIGGRAPH 1985. */
static void slerp(const double from[4], const double to[4], double share, double q[4])
{
    double sign = shorter_sign(from, to), angle = arc_between(from, to, sign), sine = sin(angle);
    double of_from = 1.0 - share, of_to = share;
    if (sine > 1e-9) { /* below it the arc is straight to the last bit */
        of_from = sin((1.0 - share) * angle) / sine;
        of_to = sin(share * angle) / sine;
    }
    for (int i = 0; i < 4; i++)
        q[i] = of_from * from[i] + of_to * sign * to[i];
}

/* Signs of the four keys: q and -q are the same rotation, so each key's sign follows its neighbour's, beginning
 * at the key before. */
static void near_signs(const struct curve *curve, uint32_t key, double sign[4])
{
    uint32_t last = curve->key_count - 1;
    double before[4], from[4], to[4], after[4];
    unit_key(curve, key ? key - 1 : 0, before);
    unit_key(curve, key, from);
    unit_key(curve, key + 1, to);
    unit_key(curve, key + 2 < last ? key + 2 : last, after);
    sign[0] = shorter_sign(before, from);
    sign[1] = 1.0;
    sign[2] = shorter_sign(from, to);
    sign[3] = sign[2] * shorter_sign(to, after);
}

void curve_rotation_at(const struct curve *curve, double time_s, double rotation[4])
{
    struct span span;
    double sign[4] = {1, 1, 1, 1};
    if (!find_span(curve, time_s, &span, rotation)) {
        make_unit(rotation);
        return;
    }
    if (curve->interpolation == INTERPOLATION_LINEAR) {
        double from[4], to[4];
        unit_key(curve, span.key, from);
        unit_key(curve, span.key + 1, to);
        slerp(from, to, span.share, rotation);
    } else {
        if (curve->interpolation == INTERPOLATION_CATMULL_ROM)
            near_signs(curve, span.key, sign);
        between_keys(curve, &span, sign, rotation);
    }
    make_unit(rotation);
}

#define TURN_KEYS_MAX 16

double curve_turn_bound(const struct curve *curve, double from_s, double to_s)
{
    if (curve->interpolation != INTERPOLATION_STEP && curve->interpolation != INTERPOLATION_LINEAR)
        return INFINITY;
    double at[4], next[4], arc = 0.0;
    uint32_t last = curve->key_count - 1;
    curve_rotation_at(curve, from_s, at);
    uint32_t key =
        from_s >= time_at(curve, 0) ? (from_s < time_at(curve, last) ? key_before(curve, from_s) + 1 : last) : 0;
    for (uint32_t keys = 0; key <= last && time_at(curve, key) < to_s; key++, keys++) {
        if (keys == TURN_KEYS_MAX)
            return INFINITY;
        unit_key(curve, key, next);
        arc += arc_between(at, next, shorter_sign(at, next));
        memcpy(at, next, sizeof(at));
    }
    curve_rotation_at(curve, to_s, next);
    return 2.0 * (arc + arc_between(at, next, shorter_sign(at, next)));
}
