/* SPDX-License-Identifier: MIT */
#include "placement.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define RADIANS_PER_DEGREE 0.017453292519943295

struct placement placement_identity(void)
{
    return (struct placement){{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
}

void placement_turn(const double axis[3], double degrees, double rotation[4])
{
    double half = degrees * RADIANS_PER_DEGREE / 2;
    double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);

    for (int c = 0; c < 3; c++)
        rotation[c] = length > 0 ? axis[c] / length * sin(half) : 0;
    rotation[3] = length > 0 ? cos(half) : 1;
}

struct placement placement_from_parts(const double scale[3], const double rotation[4], const double translation[3])
{
    double x = rotation[0], y = rotation[1], z = rotation[2], w = rotation[3];
    const double turned[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                                 {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                                 {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    struct placement a;

    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++)
            a.m[row * 4 + column] = turned[row][column] * scale[column];
        a.m[row * 4 + 3] = translation[row];
    }
    return a;
}

struct placement placement_product(const struct placement *a, const struct placement *b)
{
    struct placement product;

    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++) {
            double sum = column == 3 ? a->m[row * 4 + 3] : 0;

            for (int k = 0; k < 3; k++)
                sum += a->m[row * 4 + k] * b->m[k * 4 + column];
            product.m[row * 4 + column] = sum;
        }
    return product;
}

bool placement_is_identity(const struct placement *a)
{
    struct placement identity = placement_identity();

    for (int i = 0; i < 12; i++)
        if (a->m[i] < identity.m[i] || a->m[i] > identity.m[i])
            return false;
    return true;
}

bool placement_within(const struct placement *a, double limit)
{
    for (int i = 0; i < 12; i++)
        if (!(fabs(a->m[i]) <= limit))
            return false;
    return true;
}

/* The matrix of the cofactors of the linear part. */
static void cofactors(const struct placement *a, double out[3][3])
{
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++) {
            int r1 = (row + 1) % 3 * 4, r2 = (row + 2) % 3 * 4, c1 = (column + 1) % 3, c2 = (column + 2) % 3;

            out[row][column] = a->m[r1 + c1] * a->m[r2 + c2] - a->m[r1 + c2] * a->m[r2 + c1];
        }
}

double placement_determinant(const struct placement *a)
{
    double minors[3][3];

    cofactors(a, minors);
    return a->m[0] * minors[0][0] + a->m[1] * minors[0][1] + a->m[2] * minors[0][2];
}

bool placement_is_even(const struct placement *a)
{
    double length2 = cbrt(placement_determinant(a) * placement_determinant(a));

    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double product = a->m[i] * a->m[j] + a->m[4 + i] * a->m[4 + j] + a->m[8 + i] * a->m[8 + j];

            if (!(fabs(product - (i == j ? length2 : 0)) <= 1e-3 * length2))
                return false;
        }
    return true;
}

void placement_point(const struct placement *a, const float in[3], float out[3])
{
    for (int row = 0; row < 3; row++)
        out[row] = (float)(a->m[row * 4] * (double)in[0] + a->m[row * 4 + 1] * (double)in[1] +
                           a->m[row * 4 + 2] * (double)in[2] + a->m[row * 4 + 3]);
}

void placement_normal(const struct placement *a, const float in[3], float out[3])
{
    double minors[3][3], sign = placement_determinant(a) < 0 ? -1 : 1;

    cofactors(a, minors);
    for (int row = 0; row < 3; row++)
        out[row] = (float)(sign * (minors[row][0] * (double)in[0] + minors[row][1] * (double)in[1] +
                                   minors[row][2] * (double)in[2]));
}

void placement_to_floats(const struct placement *a, float out[12])
{
    for (int i = 0; i < 12; i++)
        out[i] = (float)a->m[i];
}
