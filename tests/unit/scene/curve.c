/* SPDX-License-Identifier: MIT */
/* Numbers through keys, against closed forms. */
#include "scene/curve.h"
#include "tests/harness/test.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

static void expect(const char *what, double got, double expected, double tolerance)
{
    if (!(fabs(got - expected) <= tolerance))
        fail_msg("%s: %.12g, expected %.12g", what, got, expected);
}

static struct curve curve_of(enum interpolation interpolation, const float *times, uint32_t key_count,
                             const float *values, uint32_t width)
{
    bool has_controls = interpolation == INTERPOLATION_CUBIC_SPLINE || interpolation == INTERPOLATION_BEZIER;
    return (struct curve){
        .times = times,
        .values = values,
        .time_stride = 1,
        .key_stride = (size_t)width * (has_controls ? 3 : 1),
        .key_count = key_count,
        .width = width,
        .interpolation = interpolation,
    };
}

static double number_at(const struct curve *curve, double time_s)
{
    double value;
    assert_int_equal(curve->width, 1);
    curve_at(curve, time_s, &value);
    return value;
}

TEST(a_step_holds_until_the_next_key)
{
    const float times[] = {1, 2, 4}, values[] = {10, 20, 40};
    struct curve curve = curve_of(INTERPOLATION_STEP, times, 3, values, 1);
    const double cases[][2] = {{-5, 10}, {1, 10}, {1.999, 10}, {2, 20}, {3.9, 20}, {4, 40}, {9, 40}};
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++)
        assert_true(number_at(&curve, cases[i][0]) == cases[i][1]);
}

TEST(a_line_is_straight_between_keys_and_still_outside)
{
    const float times[] = {1, 2, 4}, values[] = {10, 1, 20, 2, 40, -6};
    struct curve curve = curve_of(INTERPOLATION_LINEAR, times, 3, values, 2);
    const double cases[][3] = {{0, 10, 1},  {1.25, 12.5, 1.25}, {2, 20, 2},
                               {3, 30, -2}, {3.5, 35, -4},      {5, 40, -6}};
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        double value[2];
        curve_at(&curve, cases[i][0], value);
        expect("first number", value[0], cases[i][1], 1e-12);
        expect("second number", value[1], cases[i][2], 1e-12);
    }
}

/* Two cubic polynomials that meet at 2 with different slopes: a spline with their slopes as tangents is them. */
static double polynomial(double t)
{
    return t < 2 ? ((0.5 * t - 2) * t + 1) * t + 3 : ((-t + 8) * t - 17) * t + 11;
}

static double slope_before(double t)
{
    return (1.5 * t - 4) * t + 1;
}

static double slope_behind(double t)
{
    return (-3 * t + 16) * t - 17;
}

TEST(a_cubic_spline_is_the_polynomial_that_its_tangents_are_of)
{
    assert_true(polynomial(2) == 1.0 && polynomial(2 - 1e-12) > 0.999999 && polynomial(2 - 1e-12) < 1.000001);
    const float times[] = {0, 2, 5}, unused = 1e6f;
    const float values[] = {
        unused,
        (float)polynomial(0),
        (float)slope_before(0),
        (float)slope_before(2),
        (float)polynomial(2),
        (float)slope_behind(2),
        (float)slope_behind(5),
        (float)polynomial(5),
        unused,
    };
    struct curve curve = curve_of(INTERPOLATION_CUBIC_SPLINE, times, 3, values, 1);
    for (double t = 0; t <= 5; t += 0.0625)
        expect("spline", number_at(&curve, t), polynomial(t), 1e-12);
    assert_true(number_at(&curve, -1) == polynomial(0));
    assert_true(number_at(&curve, 6) == polynomial(5));
}

TEST(catmull_rom_goes_through_its_keys_with_the_slope_between_their_neighbours)
{
    /* Unevenly spaced, worked out by hand: slopes 0 and 1/3 at the inner keys, 2 s apart. */
    const float times[] = {0, 1, 3, 4}, values[] = {0, 1, 0, 2};
    struct curve curve = curve_of(INTERPOLATION_CATMULL_ROM, times, 4, values, 1);
    expect("middle of the middle", number_at(&curve, 2), 0.5 - 0.125 * 2 / 3, 1e-12);
    /* The first span: slopes 1 (to the only neighbour) and 0. At its middle 1/2 + (1 - 0) / 8. */
    expect("middle of the first", number_at(&curve, 0.5), 0.5 + 0.125, 1e-12);
    for (int i = 0; i < 4; i++)
        assert_true(number_at(&curve, (double)times[i]) == (double)values[i]);
    /* No kink: the slopes on both sides of a key are the same. */
    for (int i = 1; i < 3; i++) {
        double t = (double)times[i], h = 1e-6;
        double before = (number_at(&curve, t) - number_at(&curve, t - h)) / h;
        double behind = (number_at(&curve, t + h) - number_at(&curve, t)) / h;
        expect("slope", before, behind,
               1e-5); /* error of the difference quotients: second derivative (< 4) times h */
    }
    /* Evenly spaced keys of a parabola: inside, it is the parabola. */
    const float even[] = {0, 1, 2, 3, 4}, squares[] = {0, 1, 4, 9, 16};
    curve = curve_of(INTERPOLATION_CATMULL_ROM, even, 5, squares, 1);
    for (double t = 1; t <= 3; t += 0.0625)
        expect("parabola", number_at(&curve, t), t * t, 1e-12);
}

/* De Casteljau: midpoints of midpoints, which says nothing of Bernstein's polynomials. */
static double casteljau(double a, double b, double c, double d, double t)
{
    double ab = a + (b - a) * t, bc = b + (c - b) * t, cd = c + (d - c) * t;
    double abc = ab + (bc - ab) * t, bcd = bc + (cd - bc) * t;
    return abc + (bcd - abc) * t;
}

TEST(a_bezier_span_has_the_control_values_of_its_two_keys)
{
    const float times[] = {1, 3, 4};
    const float values[] = {99, 2, 5, -1, 4, 8, 7, 0, 99}; /* each: before, own, behind */
    struct curve curve = curve_of(INTERPOLATION_BEZIER, times, 3, values, 1);
    for (double u = 0; u < 1; u += 0.0625) {
        expect("first span", number_at(&curve, 1 + 2 * u), casteljau(2, 5, -1, 4, u), 1e-12);
        expect("second span", number_at(&curve, 3 + u), casteljau(4, 8, 7, 0, u), 1e-12);
    }
    /* Controls a third of the way along a line: the line. */
    const float line[] = {0, 0, 1, 2, 3, 0}, ends[] = {0, 6};
    curve = curve_of(INTERPOLATION_BEZIER, ends, 2, line, 1);
    for (double t = 0; t <= 6; t += 0.25)
        expect("line", number_at(&curve, t), t / 2, 1e-12);
}

TEST(one_key_is_its_value_at_any_time)
{
    const float time = 2, values[] = {3, 4, 5};
    for (int i = 0; i <= INTERPOLATION_BEZIER; i++) {
        struct curve curve = curve_of((enum interpolation)i, &time, 1, values, 1);
        double own = curve.key_stride == 3 ? 4 : 3;
        for (double t = 0; t < 5; t++)
            assert_true(number_at(&curve, t) == own);
    }
}

TEST(a_span_is_found_among_many_keys)
{
    enum { KEYS = 1000 };
    float times[KEYS], values[KEYS];
    for (int i = 0; i < KEYS; i++) {
        times[i] = (float)(i * i) / 16.0f;
        values[i] = (float)(i % 7);
    }
    struct curve curve = curve_of(INTERPOLATION_STEP, times, KEYS, values, 1);
    for (int i = 0; i + 1 < KEYS; i++) {
        assert_true(number_at(&curve, (double)times[i]) == (double)values[i]);
        assert_true(number_at(&curve, ((double)times[i] + (double)times[i + 1]) / 2) == (double)values[i]);
    }
}

/* ---- rotations ---------------------------------------------------------------------------------- */

static const double axis[3] = {2.0 / 7, -3.0 / 7, 6.0 / 7};

static void turn(double degrees, double scale, float q[4])
{
    double half = degrees * PI / 360;
    for (int i = 0; i < 3; i++)
        q[i] = (float)(axis[i] * sin(half) * scale);
    q[3] = (float)(cos(half) * scale);
}

/* Compares rotations, so that q and -q are the same. */
static void expect_turn(const char *what, const double q[4], double degrees, double tolerance)
{
    double half = degrees * PI / 360, along = 0, length = 0;
    double expected[4] = {axis[0] * sin(half), axis[1] * sin(half), axis[2] * sin(half), cos(half)};
    for (int i = 0; i < 4; i++) {
        along += q[i] * expected[i];
        length += q[i] * q[i];
    }
    expect("length", sqrt(length), 1, 1e-12);
    for (int i = 0; i < 4; i++)
        expect(what, along < 0 ? -q[i] : q[i], expected[i], tolerance);
}

TEST(slerp_turns_evenly_along_the_shorter_arc)
{
    const double arcs[][3] = {{20, 140, 120}, {10, 350, -20}, {-90, 80, 170}, {30, 30, 0}, {5, 5.001, 0.001}};
    for (size_t i = 0; i < sizeof(arcs) / sizeof(arcs[0]); i++) {
        const float times[] = {1, 3};
        float values[8];
        turn(arcs[i][0], 1, values);
        turn(arcs[i][1], 1, values + 4);
        struct curve curve = curve_of(INTERPOLATION_LINEAR, times, 2, values, 4);
        for (double share = 0; share <= 1; share += 0.125) {
            double q[4];
            curve_rotation_at(&curve, 1 + 2 * share, q);
            expect_turn("slerp", q, arcs[i][0] + arcs[i][2] * share, 1e-7); /* keys are floats */
        }
    }
}

TEST(keys_of_another_length_or_sign_are_the_same_rotation)
{
    const float times[] = {0, 1, 2, 3};
    const double degrees[] = {10, 50, 20, 90}, scales[] = {1, -2, 0.25, -1e6};
    float plain[16], scaled[16];
    for (int key = 0; key < 4; key++) {
        turn(degrees[key], 1, plain + 4 * key);
        turn(degrees[key], scales[key], scaled + 4 * key);
    }
    for (double t = 0; t <= 3; t += 0.0625) {
        struct curve a = curve_of(INTERPOLATION_LINEAR, times, 4, plain, 4),
                     b = curve_of(INTERPOLATION_LINEAR, times, 4, scaled, 4);
        int span = t >= 3 ? 2 : (int)t;
        double q[4], expected = degrees[span] + (degrees[span + 1] - degrees[span]) * (t - span);
        curve_rotation_at(&a, t, q);
        expect_turn("plain", q, expected, 1e-6);
        curve_rotation_at(&b, t, q);
        expect_turn("scaled", q, expected, 1e-6);
    }
}

TEST(catmull_rom_does_not_see_the_sign_of_a_quaternion)
{
    const float times[] = {0, 1, 2, 3, 4};
    const double degrees[] = {0, 40, 90, 100, 200};
    float plain[20];
    for (int key = 0; key < 5; key++)
        turn(degrees[key], 1, plain + 4 * key);
    for (int signs = 1; signs < 32; signs++) {
        float turned[20];
        for (int i = 0; i < 20; i++)
            turned[i] = signs >> (i / 4) & 1 ? -plain[i] : plain[i];
        struct curve a = curve_of(INTERPOLATION_CATMULL_ROM, times, 5, plain, 4),
                     b = curve_of(INTERPOLATION_CATMULL_ROM, times, 5, turned, 4);
        for (double t = 0; t <= 4; t += 0.25) {
            double p[4], q[4], along = 0;
            curve_rotation_at(&a, t, p);
            curve_rotation_at(&b, t, q);
            for (int i = 0; i < 4; i++)
                along += p[i] * q[i];
            expect("the same rotation", fabs(along), 1, 1e-12);
        }
    }
}

TEST(what_has_no_direction_is_no_rotation)
{
    const float times[] = {0, 1}, zero[8] = {0}, opposite[8] = {0, 0, 0, 1, 0, 0, 1, 0};
    struct curve curve = curve_of(INTERPOLATION_LINEAR, times, 2, zero, 4);
    double q[4];
    for (double t = 0; t <= 1; t += 0.5) {
        curve_rotation_at(&curve, t, q);
        assert_memory_equal(q, ((double[]){0, 0, 0, 1}), sizeof(q));
    }
    /* Half a turn apart both arcs are as short; what comes is a rotation. */
    curve = curve_of(INTERPOLATION_LINEAR, times, 2, opposite, 4);
    curve_rotation_at(&curve, 0.5, q);
    expect("unit", q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-12);
}

TEST(a_spline_of_rotations_is_made_unit)
{
    const float times[] = {0, 1};
    float values[24] = {0};
    turn(0, 1, values + 4);
    turn(90, 1, values + 16);
    struct curve curve = curve_of(INTERPOLATION_CUBIC_SPLINE, times, 2, values, 4);
    double q[4];
    /* Without tangents the middle is the mean of the two, half way along the arc. */
    curve_rotation_at(&curve, 0.5, q);
    expect_turn("middle", q, 45, 1e-7);
    curve_rotation_at(&curve, 0.25, q);
    expect("unit", q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-12);
}

TEST(how_far_a_rotation_turns_is_the_sum_of_its_arcs)
{
    const float times[] = {0, 1, 2, 3, 4};
    const double degrees[] = {0, 40, 90, 80, 180};
    float values[20];
    for (int key = 0; key < 5; key++)
        turn(degrees[key], key % 2 ? -1 : 1, values + 4 * key);
    struct curve curve = curve_of(INTERPOLATION_LINEAR, times, 5, values, 4);
    const double cases[][3] = {{0.5, 3.5, 20 + 50 + 10 + 50},
                               {-3, 9, 200},
                               {1.25, 1.5, 12.5},
                               {1, 2, 50},
                               {-2, -1, 0},
                               {5, 6, 0},
                               {2, 2.5, 5},
                               {3.9, 4, 10}};
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++)
        expect("turn", curve_turn_bound(&curve, cases[i][0], cases[i][1]) * 180 / PI, cases[i][2], 1e-4);
    curve.interpolation = INTERPOLATION_STEP;
    expect("steps", curve_turn_bound(&curve, 0.5, 3.5) * 180 / PI, 40 + 50 + 10, 1e-4);
    curve.interpolation = INTERPOLATION_CATMULL_ROM;
    assert_true(isinf(curve_turn_bound(&curve, 0, 1)));
}
