/* SPDX-License-Identifier: MIT */
/* Boxes along the axes. */
#ifndef FARLIGHT_PROTOCOL_COMMON_BOX_H
#define FARLIGHT_PROTOCOL_COMMON_BOX_H

#include <math.h>
#include <string.h>

/* Replaces a box by the box around its image under the matrix (3x4, row-major).  Arvo. Transforming Axis-
 * Aligned Bounding Boxes (Graphics Gems, 1990). */
static inline void box_transform(const float matrix[12], double lower[3], double upper[3])
{
    double low[3], high[3];
    for (int row = 0; row < 3; row++) {
        low[row] = high[row] = (double)matrix[4 * row + 3];
        for (int column = 0; column < 3; column++) {
            const double a = (double)matrix[4 * row + column] * lower[column];
            const double b = (double)matrix[4 * row + column] * upper[column];
            low[row] += fmin(a, b);
            high[row] += fmax(a, b);
        }
    }
    memcpy(lower, low, sizeof(low));
    memcpy(upper, high, sizeof(high));
}

#endif
