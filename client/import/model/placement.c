/* SPDX-License-Identifier: MIT */
/* Transforms in doubles. */
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

void placement_to_floats(const struct placement *a, float out[12])
{
    for (int i = 0; i < 12; i++)
        out[i] = (float)a->m[i];
}
