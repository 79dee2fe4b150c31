/* SPDX-License-Identifier: MIT */
/* Lights that have an extent are sampled: what comes out goes to the closed form as the samples grow, at least as
 * fast as independent samples would, and is right in the mean however few they are. */
#include "tests/accuracy/render_fixture.h"

#include "shared/path.h"
#include "tests/harness/test.h"

#define PI 3.14159265358979323846

enum { PIXELS = 16, SEEDS_MANY = 8, SEEDS_FEW = 2 };
#define RADIANCE 2.0

/* The eye is 5 above the place, and light is gathered that share above it. */
static const double place[3] = {0.0, 0.0, 5.0 * (double)PATH_OFFSET};

/* A frame in which all pixels see one place on a white plane, each with samples of its own. */
static void one_place(struct fixture *fixture)
{
    fixture_clear((void **)&fixture);
    fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
    fixture->request.width = fixture->request.height = PIXELS;
    fixture->request.camera.fov_y = 1e-5f;
}

/* Where the last light stands: turned about y, then about z. */
static void turn_light(struct fixture *fixture, double about_y, double about_z, const double position[3])
{
    float *m = fixture->edits[fixture->edit_count - 1].set.node.parent_from_node;
    double cy = cos(about_y), sy = sin(about_y), cz = cos(about_z), sz = sin(about_z);
    const double rows[12] = {cz * cy, -sz,         cz * sy, position[0], sz * cy, cz,
                             sz * sy, position[1], -sy,     0.0,         cy,      position[2]};
    for (int i = 0; i < 12; i++)
        m[i] = (float)rows[i];
}

/* Irradiance on a plane that looks to +z from a polygon of uniform radiance, all of it above: Lambert.
 * Photometria. 1760. */
static double polygon_irradiance(const double (*corners)[3], int count)
{
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        double a[3], b[3], la = 0.0, lb = 0.0, dot = 0.0;
        for (int k = 0; k < 3; k++) {
            a[k] = corners[i][k] - place[k];
            b[k] = corners[(i + 1) % count][k] - place[k];
            la += a[k] * a[k];
            lb += b[k] * b[k];
            dot += a[k] * b[k];
        }
        double across[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        double sine = sqrt(across[0] * across[0] + across[1] * across[1] + across[2] * across[2]);
        sum += acos(dot / sqrt(la * lb)) * across[2] / sine;
    }
    return fabs(sum) * RADIANCE / 2.0;
}

/* `lowest`: what of the light is below that is not seen (where its edges are level or upright). */
static double rectangle(struct fixture *fixture, double width, double height, double about_y, double about_z,
                        const double position[3], double lowest)
{
    struct scene_light *light = fixture_light(fixture, LIGHT_RECTANGLE, 0.0f, 0.0f, 0.0f, (float)RADIANCE);
    light->size[0] = (float)width;
    light->size[1] = (float)height;
    turn_light(fixture, about_y, about_z, position);
    const float *m = fixture->edits[fixture->edit_count - 1].set.node.parent_from_node;
    double corners[4][3];
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++)
            corners[i][k] = (double)m[4 * k + 3] + (i == 1 || i == 2 ? 0.5 : -0.5) * width * (double)m[4 * k] +
                            (i >= 2 ? 0.5 : -0.5) * height * (double)m[4 * k + 1];
    for (int i = 0; i < 4; i++)
        corners[i][2] = fmax(corners[i][2], lowest);
    return polygon_irradiance(corners, 4);
}

/* All of it above the horizon: what a disc of the same outline gives. */
static double sphere(struct fixture *fixture, double radius, const double position[3])
{
    struct scene_light *light = fixture_light(fixture, LIGHT_SPHERE, 0.0f, 0.0f, 0.0f, (float)RADIANCE);
    light->size[0] = (float)radius;
    turn_light(fixture, 0.0, 0.0, position);
    double to[3] = {position[0] - place[0], position[1] - place[1], position[2] - place[2]};
    double distance2 = to[0] * to[0] + to[1] * to[1] + to[2] * to[2];
    return PI * RADIANCE * radius * radius / distance2 * to[2] / sqrt(distance2);
}

/* Of what a pixel says over the closed form, less 1. */
struct estimate {
    double mean, standard_error, deviation;
};

static struct estimate estimate(struct fixture *fixture, uint32_t samples, double expected)
{
    double sum = 0.0, squares = 0.0;
    uint32_t seeds = samples <= 64 ? SEEDS_MANY : SEEDS_FEW, count = seeds * PIXELS * PIXELS;
    fixture->request.samples = samples;
    for (uint32_t seed = 0; seed < seeds; seed++) {
        fixture->request.seed = seed * 7919 + samples; /* none twice */
        struct frame_result result = fixture_render(fixture);
        for (uint32_t i = 0; i < PIXELS * PIXELS; i++) {
            double off = (double)fixture_pixel(&result, i % PIXELS, i / PIXELS)[0] * PI / expected - 1.0;
            sum += off;
            squares += off * off;
        }
        frame_result_finish(&result);
    }
    struct estimate found = {.mean = sum / count};
    found.deviation = sqrt(squares / count - found.mean * found.mean);
    found.standard_error = found.deviation / sqrt(count);
    return found;
}

/* The slope of log deviation over log samples, 4 .. maximum. */
static void expect_convergence(struct fixture *fixture, const char *name, double expected, uint32_t maximum)
{
    double x_sum = 0.0, y_sum = 0.0, xx = 0.0, xy = 0.0, steps = 0.0;
    for (uint32_t samples = 4; samples <= maximum; samples *= 4) {
        struct estimate found = estimate(fixture, samples, expected);
        double x = log(samples), y = log(found.deviation);
        print_message("%-10s %4u samples: off by %+.1e in the mean (standard error %.1e), %.1e each\n", name,
                      samples, found.mean, found.standard_error, found.deviation);
        /* 4 standard errors, and a sum of up to 1024 floats */
        assert_near(found.mean, 0.0, 4.0 * found.standard_error + 2e-6);
        x_sum += x;
        y_sum += y;
        xx += x * x;
        xy += x * y;
        steps += 1.0;
    }
    double slope = (steps * xy - x_sum * y_sum) / (steps * xx - x_sum * x_sum);
    print_message("%-10s slope %.2f\n", name, slope);
    /* Independent samples have -0.5, a lattice is steeper. The deviations are known to 3 % each, which makes 0.01
     * of the slope over 5 of them: five times that. */
    assert_true(slope <= -0.45);
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(a_rectangle_light_converges_to_lamberts_formula)
{
    struct fixture *fixture = *state;
    one_place(fixture);
    double expected = rectangle(fixture, 1.5, 0.5, 0.7, 0.4, (double[3]){1.2, 0.3, 1.5}, -INFINITY);
    expect_convergence(fixture, "rectangle", expected, 1024);
}

TEST(a_rectangle_light_that_stands_in_the_horizon_gives_what_is_above)
{
    struct fixture *fixture = *state;
    one_place(fixture);
    double expected = rectangle(fixture, 1.5, 0.8, PI / 2.0, 0.3, (double[3]){1.0, 0.4, 0.2}, place[2]);
    expect_convergence(fixture, "horizon", expected, 64);
}

TEST(a_sphere_light_converges_to_its_solid_angle)
{
    struct fixture *fixture = *state;
    one_place(fixture);
    double expected = sphere(fixture, 0.5, (double[3]){1.0, -0.5, 0.9});
    expect_convergence(fixture, "sphere", expected, 1024);
}
