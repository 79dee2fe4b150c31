/* SPDX-License-Identifier: MIT */
#include "spline.h"

#include <math.h>
#include <string.h>

/* How much of the difference to the neighbours before and after goes into a tangent of key i. A tangent is per
 * segment: the adjustment for uneven keys makes both sides agree in speed. */
struct shares {
    double before, after;
};

/* What leaves keys[i] for the segment that follows. Keys at one time have no speed between them. */
static struct shares outgoing_shares(const struct spline_key *keys, size_t i)
{
    const struct spline_key *key = &keys[i];
    double span = keys[i + 1].time - keys[i - 1].time;
    double adjusted = span > 0 ? (keys[i + 1].time - key->time) / span : 0;

    return (struct shares){adjusted * (1 - key->tension) * (1 + key->continuity) * (1 + key->bias),
                           adjusted * (1 - key->tension) * (1 - key->continuity) * (1 - key->bias)};
}

/* What comes to keys[i] from the segment before. */
static struct shares incoming_shares(const struct spline_key *keys, size_t i)
{
    const struct spline_key *key = &keys[i];
    double span = keys[i + 1].time - keys[i - 1].time;
    double adjusted = span > 0 ? (key->time - keys[i - 1].time) / span : 0;

    return (struct shares){adjusted * (1 - key->tension) * (1 - key->continuity) * (1 + key->bias),
                           adjusted * (1 - key->tension) * (1 + key->continuity) * (1 - key->bias)};
}

static void by_time(const struct spline_key *keys, size_t i, struct shares shares, double duration, double out[3])
{
    for (size_t c = 0; c < 3; c++) {
        double before = keys[i].value[c] - keys[i - 1].value[c], after = keys[i + 1].value[c] - keys[i].value[c];

        out[c] = duration > 0 ? (shares.before * before + shares.after * after) / duration : 0;
    }
}

void spline_tangents(const struct spline_key *keys, size_t i, double incoming[3], double outgoing[3])
{
    by_time(keys, i, incoming_shares(keys, i), keys[i].time - keys[i - 1].time, incoming);
    by_time(keys, i, outgoing_shares(keys, i), keys[i + 1].time - keys[i].time, outgoing);
}

/* The segment that holds the time, as the number of its first key, and the place in it, 0 to 1. */
static size_t find_segment(const struct spline_key *keys, size_t count, double time, double *place)
{
    size_t i = 1, end = count - 2; /* the last that can begin one, and what is beyond */

    while (end - i > 1) {
        size_t middle = i + (end - i) / 2;

        if (keys[middle].time <= time)
            i = middle;
        else
            end = middle;
    }
    *place = fmin(fmax((time - keys[i].time) / (keys[i + 1].time - keys[i].time), 0), 1);
    if (!(keys[i + 1].time > keys[i].time))
        *place = time < keys[i].time ? 0 : 1;
    return i;
}

void spline_position(const struct spline_key *keys, size_t count, double time, double out[3], double speed[3])
{
    double s, unused[3], leaving[3], coming[3];
    size_t i = find_segment(keys, count, time, &s);
    double duration = keys[i + 1].time - keys[i].time;

    spline_tangents(keys, i, unused, leaving);
    spline_tangents(keys, i + 1, coming, unused);
    for (size_t c = 0; c < 3; c++) {
        double a = keys[i].value[c], b = keys[i + 1].value[c];

        out[c] = (2 * s * s * s - 3 * s * s + 1) * a + (3 * s * s - 2 * s * s * s) * b +
                 duration * ((s * s * s - 2 * s * s + s) * leaving[c] + (s * s * s - s * s) * coming[c]);
        if (speed)
            speed[c] = (duration > 0 ? 6 * (s - s * s) * (b - a) / duration : 0) +
                       (3 * s * s - 4 * s + 1) * leaving[c] + (3 * s * s - 2 * s) * coming[c];
    }
}

/* ---- quaternions, x y z w ---- */

static double dot(const double a[4], const double b[4])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

static void multiply(const double a[4], const double b[4], double out[4])
{
    for (int c = 0; c < 3; c++) {
        int u = (c + 1) % 3, v = (c + 2) % 3;

        out[c] = a[3] * b[c] + a[c] * b[3] + a[u] * b[v] - a[v] * b[u];
    }
    out[3] = a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2];
}

/* The logarithm of the turn from a to b: its axis times half its angle. */
static void turn_between(const double a[4], const double b[4], double out[3])
{
    const double inverse[4] = {-a[0], -a[1], -a[2], a[3]};
    double turn[4], sine, factor;

    multiply(inverse, b, turn);
    sine = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
    factor = sine > 0 ? atan2(sine, turn[3]) / sine : 0;
    for (int c = 0; c < 3; c++)
        out[c] = factor * turn[c];
}

/* a, turned by `axis` times half an angle. */
static void turn_by(const double a[4], const double axis[3], double out[4])
{
    double half = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    double factor = half > 0 ? sin(half) / half : 1;
    const double turn[4] = {factor * axis[0], factor * axis[1], factor * axis[2], cos(half)};

    multiply(a, turn, out);
}

void spline_slerp(const double a[4], const double b[4], double t, double out[4])
{
    double cosine = fmin(fmax(dot(a, b), -1), 1), angle = acos(cosine), sine = sin(angle);
    double wa = sine > 1e-6 ? sin((1 - t) * angle) / sine : 1 - t, wb = sine > 1e-6 ? sin(t * angle) / sine : t;
    double length;

    for (int c = 0; c < 4; c++)
        out[c] = wa * a[c] + wb * b[c];
    length = sqrt(dot(out, out));
    for (int c = 0; c < 4; c++)
        out[c] = length > 0 ? out[c] / length : a[c];
}

void spline_align(struct spline_key *keys, size_t count)
{
    for (size_t i = 1; i < count; i++)
        if (dot(keys[i - 1].value, keys[i].value) < 0)
            for (int c = 0; c < 4; c++)
                keys[i].value[c] = -keys[i].value[c];
}

/* The inner control point of squad beside keys[i]: `sign` 1 for what leaves it, -1 for what comes to it, over
 * `along`, the turn of the segment. */
static void control_point(const struct spline_key *keys, size_t i, struct shares shares, const double along[3],
                          double sign, double out[4])
{
    double before[3], after[3], offset[3];

    turn_between(keys[i - 1].value, keys[i].value, before);
    turn_between(keys[i].value, keys[i + 1].value, after);
    for (int c = 0; c < 3; c++)
        offset[c] = sign * (shares.before * before[c] + shares.after * after[c] - along[c]) / 2;
    turn_by(keys[i].value, offset, out);
}

void spline_rotation(const struct spline_key *keys, size_t count, double time, double out[4])
{
    double s, along[3], a[4], b[4], outer[4], inner[4];
    size_t i = find_segment(keys, count, time, &s);

    turn_between(keys[i].value, keys[i + 1].value, along);
    control_point(keys, i, outgoing_shares(keys, i), along, 1, a);
    control_point(keys, i + 1, incoming_shares(keys, i + 1), along, -1, b);
    spline_slerp(keys[i].value, keys[i + 1].value, s, outer);
    spline_slerp(a, b, s, inner);
    spline_slerp(outer, inner, 2 * s * (1 - s), out);
}
