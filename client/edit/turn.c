/* SPDX-License-Identifier: MIT */
/* Angles and scale of a node's matrix. */
#include "edit/turn.h"

#include <math.h>

#define DEGREES_PER_RADIAN 57.29577951308232
#define POLE 0.9999999 /* sine of the second angle beyond which the other two turn about the same axis */

void edit_turn_load(const float matrix[12], double degrees[3], double scale[3])
{
    double turn[3][3]; /* rotation, by row */
    for (int c = 0; c < 3; c++) {
        const double x = (double)matrix[c], y = (double)matrix[4 + c], z = (double)matrix[8 + c];
        const double length = sqrt(x * x + y * y + z * z);
        scale[c] = length;
        turn[0][c] = length > 0 ? x / length : c == 0;
        turn[1][c] = length > 0 ? y / length : c == 1;
        turn[2][c] = length > 0 ? z / length : c == 2;
    }
    const double determinant = turn[0][0] * (turn[1][1] * turn[2][2] - turn[1][2] * turn[2][1]) -
                               turn[0][1] * (turn[1][0] * turn[2][2] - turn[1][2] * turn[2][0]) +
                               turn[0][2] * (turn[1][0] * turn[2][1] - turn[1][1] * turn[2][0]);
    if (determinant < 0) {
        scale[0] = -scale[0];
        for (int row = 0; row < 3; row++)
            turn[row][0] = -turn[row][0];
    }
    const double sine = fmin(fmax(-turn[2][0], -1), 1);
    degrees[1] = asin(sine) * DEGREES_PER_RADIAN;
    degrees[0] = atan2(turn[2][1], turn[2][2]) * DEGREES_PER_RADIAN;
    degrees[2] = atan2(turn[1][0], turn[0][0]) * DEGREES_PER_RADIAN;
    if (fabs(sine) > POLE) {
        degrees[0] = atan2(-turn[1][2], turn[1][1]) * DEGREES_PER_RADIAN;
        degrees[2] = 0;
    }
}

void edit_turn_store(float matrix[12], const double degrees[3], const double scale[3])
{
    double s[3], c[3];
    for (int axis = 0; axis < 3; axis++) {
        s[axis] = sin(degrees[axis] / DEGREES_PER_RADIAN);
        c[axis] = cos(degrees[axis] / DEGREES_PER_RADIAN);
    }
    const double turn[3][3] = {
        {c[2] * c[1], c[2] * s[1] * s[0] - s[2] * c[0], c[2] * s[1] * c[0] + s[2] * s[0]},
        {s[2] * c[1], s[2] * s[1] * s[0] + c[2] * c[0], s[2] * s[1] * c[0] - c[2] * s[0]},
        {-s[1], c[1] * s[0], c[1] * c[0]},
    };
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            matrix[4 * row + column] = (float)(turn[row][column] * scale[column]);
}
