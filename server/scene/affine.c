/* SPDX-License-Identifier: MIT */
/* Products, inverses and bounds of affine transforms. */
#include "scene/affine.h"

#include "scene/affine_double.h"

#include <math.h>
#include <string.h>

/* Share of the largest determinant that rows of these lengths could have, below which the third direction is
 * rounding of 24-bit entries and the inverse would be noise. */
#define SINGULAR_SHARE 2e-7

void affine_double_identity(double m[12])
{
    memset(m, 0, 12 * sizeof(*m));
    m[0] = m[5] = m[10] = 1.0;
}

void affine_double_multiply(double a_from_c[12], const double a_from_b[12], const float b_from_c[12])
{
    double product[12];
    for (int row = 0; row < 3; row++) {
        const double *a = a_from_b + 4 * row;
        for (int column = 0; column < 4; column++)
            product[4 * row + column] = a[0] * (double)b_from_c[column] + a[1] * (double)b_from_c[4 + column] +
                                        a[2] * (double)b_from_c[8 + column] + (column == 3 ? a[3] : 0.0);
    }
    memcpy(a_from_c, product, sizeof(product));
}

static double row_length(const double *row)
{
    return sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]);
}

bool affine_double_invert(float b_from_a[12], const double m[12])
{
    memset(b_from_a, 0, 12 * sizeof(*b_from_a));
    /* Rows of unit length keep the products of very large or small scales within the range of doubles. */
    double length[3], unit[3][3];
    for (int row = 0; row < 3; row++) {
        length[row] = row_length(m + 4 * row);
        if (!(length[row] > 0.0) || !isfinite(length[row]))
            return false;
        for (int column = 0; column < 3; column++)
            unit[row][column] = m[4 * row + column] / length[row];
    }
    double cofactor[3][3];
    for (int row = 0; row < 3; row++) {
        const double *p = unit[(row + 1) % 3], *q = unit[(row + 2) % 3];
        for (int column = 0; column < 3; column++) {
            int c1 = (column + 1) % 3, c2 = (column + 2) % 3;
            cofactor[row][column] = p[c1] * q[c2] - p[c2] * q[c1];
        }
    }
    double determinant = unit[0][0] * cofactor[0][0] + unit[0][1] * cofactor[0][1] + unit[0][2] * cofactor[0][2];
    if (!(fabs(determinant) > SINGULAR_SHARE))
        return false;
    double inverse[12];
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++)
            inverse[4 * row + column] = cofactor[column][row] / (determinant * length[column]);
        const double *r = inverse + 4 * row;
        inverse[4 * row + 3] = -(r[0] * m[3] + r[1] * m[7] + r[2] * m[11]);
    }
    if (affine_double_round(b_from_a, inverse))
        return true;
    memset(b_from_a, 0, 12 * sizeof(*b_from_a));
    return false;
}

bool affine_double_round(float out[12], const double m[12])
{
    bool is_finite = true;
    for (int i = 0; i < 12; i++) {
        out[i] = (float)m[i];
        is_finite = is_finite && isfinite(out[i]);
    }
    return is_finite;
}

void affine_identity(float m[12])
{
    memset(m, 0, 12 * sizeof(*m));
    m[0] = m[5] = m[10] = 1.0f;
}

static void widen(double out[12], const float m[12])
{
    for (int i = 0; i < 12; i++)
        out[i] = (double)m[i];
}

void affine_multiply(float a_from_c[12], const float a_from_b[12], const float b_from_c[12])
{
    double product[12];
    widen(product, a_from_b);
    affine_double_multiply(product, product, b_from_c);
    affine_double_round(a_from_c, product);
}

bool affine_invert(float b_from_a[12], const float a_from_b[12])
{
    double wide[12];
    widen(wide, a_from_b);
    return affine_double_invert(b_from_a, wide);
}

void affine_vector(float out[3], const float m[12], const float vector[3])
{
    double x = (double)vector[0], y = (double)vector[1], z = (double)vector[2];
    for (int row = 0; row < 3; row++) {
        const float *r = m + 4 * row;
        out[row] = (float)((double)r[0] * x + (double)r[1] * y + (double)r[2] * z);
    }
}

void affine_point(float out[3], const float m[12], const float point[3])
{
    double x = (double)point[0], y = (double)point[1], z = (double)point[2];
    for (int row = 0; row < 3; row++) {
        const float *r = m + 4 * row;
        out[row] = (float)((double)r[0] * x + (double)r[1] * y + (double)r[2] * z + (double)r[3]);
    }
}

/* Bounds of a transformed box. Arvo, Transforming axis-aligned bounding boxes, Graphics Gems 1990: each entry
 * of the matrix adds its smaller product to the lower bound and its larger one to the upper. */
void affine_bounds(float out_lower[3], float out_upper[3], const float m[12], const float lower[3],
                   const float upper[3])
{
    double new_lower[3], new_upper[3];
    for (int row = 0; row < 3; row++) {
        new_lower[row] = new_upper[row] = (double)m[4 * row + 3];
        for (int column = 0; column < 3; column++) {
            double a = (double)m[4 * row + column] * (double)lower[column];
            double b = (double)m[4 * row + column] * (double)upper[column];
            new_lower[row] += a < b ? a : b;
            new_upper[row] += a < b ? b : a;
        }
    }
    for (int row = 0; row < 3; row++) {
        out_lower[row] = (float)new_lower[row];
        out_upper[row] = (float)new_upper[row];
    }
}
