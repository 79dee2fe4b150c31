/* SPDX-License-Identifier: MIT */
/* Splines of AFF's keys against values worked out on paper. */
#include "import/spline.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stddef.h>

/* The sums below are of a few exact binary fractions, sines and roots in double precision. */
#define ROUNDING 1e-12

static double position_at(const struct spline_key *keys, size_t count, double time)
{
    double out[3];
    spline_position(keys, count, time, out, NULL);
    return out[0];
}

static void assert_near(double got, double wanted)
{
    if (!(fabs(got - wanted) <= ROUNDING))
        fail_msg("%.15g instead of %.15g", got, wanted);
}

static const struct spline_key even[] = {
    {.time = 0, .value = {0}}, {.time = 1, .value = {1}}, {.time = 2, .value = {3}}, {.time = 3, .value = {2}}};

TEST(without_shape_a_spline_is_catmull_rom)
{
    /* Slopes (3 - 0) / 2 and (2 - 1) / 2; in the middle (1 + 3) / 2 + (1.5 - 0.5) / 8. */
    assert_near(position_at(even, 4, 1.5), 2.125);
    assert_near(position_at(even, 4, 1), 1);
    assert_near(position_at(even, 4, 2), 3);
}

TEST(it_rests_before_its_second_key_and_after_its_last_but_one)
{
    assert_near(position_at(even, 4, -5), 1);
    assert_near(position_at(even, 4, 0.5), 1);
    assert_near(position_at(even, 4, 2.5), 3);
    assert_near(position_at(even, 4, 9), 3);
}

TEST(tension_continuity_and_bias_shape_the_tangents)
{
    /* At key 1: before 1, after 2, t 0.5, c 0.25, b -0.5.
     * leaves: (0.5 * 1.25 * 0.5 * 1 + 0.5 * 0.75 * 1.5 * 2) / 2 = (0.3125 + 1.125) / 2
     * comes:  (0.5 * 0.75 * 0.5 * 1 + 0.5 * 1.25 * 1.5 * 2) / 2 = (0.1875 + 1.875) / 2 */
    const struct spline_key keys[] = {{.time = 0, .value = {0}},
                                      {.time = 1, .value = {1}, .tension = 0.5, .continuity = 0.25, .bias = -0.5},
                                      {.time = 2, .value = {3}},
                                      {.time = 3, .value = {2}}};
    double comes[3], leaves[3];
    spline_tangents(keys, 1, comes, leaves);
    assert_near(leaves[0], 0.71875);
    assert_near(comes[0], 1.03125);
    /* In the middle of the segment: 2 + (0.71875 - 0.5) / 8. */
    assert_near(position_at(keys, 4, 1.5), 2.02734375);
}

TEST(keys_that_are_not_evenly_spaced_have_one_speed_on_both_sides)
{
    const struct spline_key keys[] = {{.time = 0, .value = {0}},
                                      {.time = 1, .value = {2}},
                                      {.time = 4, .value = {8}},
                                      {.time = 5, .value = {9}}};
    double comes[3], leaves[3];
    spline_tangents(keys, 1, comes, leaves);
    /* Over the 4 seconds between its neighbours the value goes from 0 to 8. */
    assert_near(comes[0], 2);
    assert_near(leaves[0], 2);
    /* At key 2 (9 - 2) / 4 either way: in the middle 5 + 3 * (2 - 1.75) / 8. */
    assert_near(position_at(keys, 4, 2.5), 5.09375);
}

TEST(the_speed_is_the_derivative)
{
    const struct spline_key keys[] = {{.time = 0, .value = {0}},
                                      {.time = 1, .value = {1}},
                                      {.time = 3, .value = {3}},
                                      {.time = 5, .value = {2}}};
    double out[3], speed[3];
    spline_position(keys, 4, 2, out, speed);
    const double step = 1e-4;
    const double measured = (position_at(keys, 4, 2 + step) - position_at(keys, 4, 2 - step)) / (2 * step);
    /* A cubic's difference quotient errs by the square of the step times a derivative of about 1. */
    assert_true(fabs(speed[0] - measured) < 1e-7);
}

TEST(two_keys_at_one_time_are_a_jump)
{
    const struct spline_key keys[] = {
        {.time = 0, .value = {0}}, {.time = 1, .value = {0}}, {.time = 2, .value = {0}},
        {.time = 2, .value = {5}}, {.time = 3, .value = {5}}, {.time = 4, .value = {5}},
    };
    assert_near(position_at(keys, 6, 2), 5);
    assert_true(position_at(keys, 6, 2 - 1e-9) < 1e-6);
    /* At the later of the two keys the value before, 0, counts for the tangent: (5 - 0) * (1 / 1), as the
     * earlier key is no time away. In the middle 5 + (5 - 0) / 8. */
    assert_near(position_at(keys, 6, 2.5), 5.625);
}

static struct spline_key turned(double time, double degrees)
{
    const double half = degrees * 3.14159265358979323846 / 360;
    return (struct spline_key){.time = time, .value = {0, sin(half), 0, cos(half)}};
}

static double degrees_at(const struct spline_key *keys, size_t count, double time)
{
    double q[4];
    spline_rotation(keys, count, time, q);
    assert_near(q[0], 0);
    assert_near(q[2], 0);
    assert_near(q[1] * q[1] + q[3] * q[3], 1);
    return atan2(q[1], q[3]) * 360 / 3.14159265358979323846;
}

TEST(turns_about_one_axis_go_as_squad_says)
{
    struct spline_key keys[] = {turned(0, 0), turned(1, 0), turned(2, 80), turned(3, 120)};
    spline_align(keys, 4);
    assert_near(degrees_at(keys, 4, 1), 0);
    assert_near(degrees_at(keys, 4, 2), 80);
    assert_near(degrees_at(keys, 4, 0), 0);
    assert_near(degrees_at(keys, 4, 3), 80);
    /* Tangents (0 + 80) / 2 and (80 + 40) / 2. Control points 0 + (40 - 80) / 2 and 80 - (60 - 80) / 2.
     * In the middle the mean of 40 and (-20 + 90) / 2. */
    assert_near(degrees_at(keys, 4, 1.5), 37.5);
    /* At a quarter: 20 + 2 * 3 / 16 * ((-20 * 3 + 90) / 4 - 20). */
    assert_near(degrees_at(keys, 4, 1.25), 15.3125);
}

TEST(a_turn_takes_the_shorter_way)
{
    struct spline_key keys[] = {turned(0, 350), turned(1, 350), turned(2, 10), turned(3, 10)};
    spline_align(keys, 4);
    const double middle = degrees_at(keys, 4, 1.5);
    assert_near(fabs(remainder(middle, 360)), 0);
}
