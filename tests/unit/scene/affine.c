/* SPDX-License-Identifier: MIT */
/* Affine transforms against arithmetic in double precision. */
#include "scene/affine.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

static void assert_near(const float *got, const float *expected, int count, float tolerance)
{
    for (int i = 0; i < count; i++) {
        if (!(fabsf(got[i] - expected[i]) <= tolerance))
            fail_msg("number %d is %.9g, expected %.9g", i, (double)got[i], (double)expected[i]);
    }
}

/* Turned about z by 90 degrees, scaled by 2, 3, 4, moved to 10, 20, 30. */
static const float turned[12] = {0, -3, 0, 10, 2, 0, 0, 20, 0, 0, 4, 30};

TEST(a_product_applies_the_right_transform_first)
{
    const float moved[12] = {1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3};
    float product[12], point[3], step[3];
    const float origin[3] = {0, 0, 0};
    affine_multiply(product, turned, moved);
    affine_point(point, product, origin);
    affine_point(step, moved, origin);
    affine_point(step, turned, step);
    assert_near(point, step, 3, 0);
    assert_near(point, (const float[]){4, 22, 42}, 3, 0);
}

TEST(a_product_may_overwrite_its_factors)
{
    float expected[12], a[12], b[12];
    affine_multiply(expected, turned, turned);
    memcpy(a, turned, sizeof(a));
    memcpy(b, turned, sizeof(b));
    affine_multiply(a, a, turned);
    affine_multiply(b, b, b);
    assert_near(a, expected, 12, 0);
    assert_near(b, expected, 12, 0);
}

TEST(an_inverse_undoes_the_transform)
{
    float inverse[12], product[12], identity[12];
    affine_identity(identity);
    assert_true(affine_invert(inverse, turned));
    affine_multiply(product, inverse, turned);
    assert_near(product, identity, 12, 1e-6f);
    affine_multiply(product, turned, inverse);
    assert_near(product, identity, 12, 1e-6f);
}

TEST(very_large_and_small_scales_have_an_inverse)
{
    const float scales[] = {1e-30f, 1e-12f, 1e12f, 1e30f};
    for (int i = 0; i < 4; i++) {
        float s = scales[i], inverse[12];
        const float m[12] = {s, 0, 0, 0, 0, 1, 0, 0, 0, 0, s, 0};
        assert_true(affine_invert(inverse, m));
        assert_near(&inverse[0], (const float[]){1 / s}, 1, 1 / s * 1e-6f);
        assert_near(&inverse[5], (const float[]){1}, 1, 1e-6f);
    }
}

TEST(flattening_transforms_have_no_inverse)
{
    const float flat[][12] = {
        {1, 0, 0, 5, 0, 0, 0, 5, 0, 0, 1, 5},                             /* a row of zeros */
        {1, 2, 3, 0, 2, 4, 6, 0, 0, 0, 1, 0},                             /* two parallel rows */
        {0.6f, 0.8f, 0, 0, 0.36f, 0.48f, 0.8f, 0, 0.48f, 0.64f, 0.6f, 0}, /* rows in one plane */
        {0},
        {NAN, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
        {1e-39f, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, /* the inverse is beyond a float */
    };
    for (size_t i = 0; i < sizeof(flat) / sizeof(flat[0]); i++) {
        float inverse[12];
        memset(inverse, 0x55, sizeof(inverse));
        if (affine_invert(inverse, flat[i]))
            fail_msg("matrix %zu was inverted", i);
        assert_near(inverse, (const float[12]){0}, 12, 0);
    }
}

TEST(vectors_are_not_moved)
{
    float vector[3];
    affine_vector(vector, turned, (const float[]){1, 1, 1});
    assert_near(vector, (const float[]){-3, 2, 4}, 3, 0);
}

TEST(bounds_hold_all_corners_and_touch_them)
{
    const float sheared[12] = {0.5f, -1.5f, 0.25f, 7, 0.1f, 2, -3, -8, -1, 0.3f, 0.7f, 1};
    const float lower[3] = {-1, -2, 3}, upper[3] = {4, 5, 6};
    float got[6], expected[6] = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY};
    affine_bounds(got, got + 3, sheared, lower, upper);
    for (int corner = 0; corner < 8; corner++) {
        float point[3];
        for (int axis = 0; axis < 3; axis++)
            point[axis] = corner >> axis & 1 ? upper[axis] : lower[axis];
        affine_point(point, sheared, point);
        for (int axis = 0; axis < 3; axis++) {
            expected[axis] = fminf(expected[axis], point[axis]);
            expected[3 + axis] = fmaxf(expected[3 + axis], point[axis]);
        }
    }
    assert_near(got, expected, 6, 1e-5f);
}
