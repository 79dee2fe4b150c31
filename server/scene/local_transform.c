/* SPDX-License-Identifier: MIT */
/* Decomposition and composition of matrices. */
#include "scene/local_transform.h"

#include <math.h>
#include <string.h>

#define ENTRY_MAX 1e12

static void cross(double out[3], const double a[3], const double b[3])
{
    double product[3];
    for (int i = 0; i < 3; i++)
        product[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    memcpy(out, product, sizeof(product));
}

static double normalise(double v[3])
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3 && length > 0.0; i++)
        v[i] /= length;
    return length;
}

/* Completes the columns: one of length 0 has no direction, and gets one at right angles to the others. */
static void complete(double column[3][3], const double length[3])
{
    static const double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    int missing = -1, count = 0;
    for (int i = 0; i < 3; i++) {
        if (!(length[i] > 0.0)) {
            missing = i;
            count++;
        }
    }
    if (count == 1) {
        cross(column[missing], column[(missing + 1) % 3], column[(missing + 2) % 3]);
        if (normalise(column[missing]) > 0.0)
            return;
    }
    for (int i = 0; i < 3 && count > 0; i++)
        memcpy(column[i], axes[i], sizeof(axes[i]));
}

void local_transform_from_matrix(struct local_transform *transform, const float matrix[12])
{
    double column[3][3];
    for (int c = 0; c < 3; c++) {
        for (int row = 0; row < 3; row++)
            column[c][row] = (double)matrix[4 * row + c];
        transform->translation[c] = (double)matrix[4 * c + 3];
        transform->scale[c] = normalise(column[c]);
    }
    complete(column, transform->scale);
    double across[3];
    cross(across, column[1], column[2]);
    if (across[0] * column[0][0] + across[1] * column[0][1] + across[2] * column[0][2] < 0.0) {
        transform->scale[0] = -transform->scale[0];
        for (int row = 0; row < 3; row++)
            column[0][row] = -column[0][row];
    }
    for (int c = 0; c < 3; c++) {
        for (int row = 0; row < 3; row++)
            transform->turn[row][c] = column[c][row];
    }
}

void local_transform_set_rotation(struct local_transform *transform, const double q[4])
{
    double x = q[0], y = q[1], z = q[2], w = q[3];
    const double turn[3][3] = {
        {1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
        {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
        {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)},
    };
    memcpy(transform->turn, turn, sizeof(turn));
}

void local_transform_to_matrix(const struct local_transform *transform, float matrix[12])
{
    for (int row = 0; row < 3; row++) {
        for (int c = 0; c < 4; c++) {
            double entry = c < 3 ? transform->turn[row][c] * transform->scale[c] : transform->translation[row];
            matrix[4 * row + c] = (float)fmin(fmax(entry, -ENTRY_MAX), ENTRY_MAX);
        }
    }
}
