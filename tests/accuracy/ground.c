/* SPDX-License-Identifier: MIT */
/* The ground: what a sphere over it takes of the light, against closed forms; and that nothing else changes. */
#include "tests/accuracy/render_fixture.h"
#include "tests/harness/test.h"

#define PI 3.14159265358979323846
#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* A sphere round the origin, that high over the ground. */
#define RADIUS 0.5
#define HEIGHT 1.0

enum { EDGE = 48 };
static const enum integrator_kind shading[] = {INTEGRATOR_WHITTED, INTEGRATOR_DISTRIBUTED, INTEGRATOR_PATH};

static void begin(struct fixture *fixture, enum integrator_kind integrator)
{
    fixture_clear((void **)&fixture);
    struct scene_material *mirror = fixture_material(fixture);
    mirror->value.metallic = 1.0f;
    mirror->value.roughness = 0.0f;
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, (float)RADIUS, mirror->base.id);
    fixture->request.picture.width = fixture->request.picture.height = EDGE;
    fixture->request.sampling.pixel_filter = FILTER_BOX;
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.light.integrator = integrator;
    fixture->request.picture.background = BACKGROUND_TRANSPARENT;
    fixture->request.ground = (struct frame_ground){
        .centre_world = {0.0f, (float)-HEIGHT, 0.0f}, .normal_world = {0.0f, 1.0f, 0.0f}, .radius = 40.0f};
    fixture_set_camera(fixture, 0.0f, 2.0f, 4.5f, 0.7f);
}

/* A light from straight above. */
static void sun(struct fixture *fixture, float irradiance)
{
    const float down[12] = {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0};
    fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, irradiance);
    memcpy(fixture->edits[fixture->edit_count - 1].set.node.value.parent_from_node, down, sizeof(down));
}

/* Where the ray through a place of the picture meets the ground: its distance from the axis below the sphere.
 * False: it meets the sphere or comes near it. */
static bool ground_at(const struct fixture *fixture, double x, double y, double *from_axis)
{
    const float *m = fixture->request.camera.world_from_view;
    const double half = tan((double)fixture->request.camera.fov_y / 2.0);
    const double view[3] = {(2.0 * x / EDGE - 1.0) * half, (1.0 - 2.0 * y / EDGE) * half, -1.0};
    double d[3], along = 0.0, squared = 0.0, nearest = 0.0;
    for (int row = 0; row < 3; row++) {
        d[row] =
            (double)m[4 * row] * view[0] + (double)m[4 * row + 1] * view[1] + (double)m[4 * row + 2] * view[2];
        along -= d[row] * (double)m[4 * row + 3];
        squared += d[row] * d[row];
    }
    for (int row = 0; row < 3; row++) {
        const double place = (double)m[4 * row + 3] + along / squared * d[row];
        nearest += place * place;
    }
    const double t = (-HEIGHT - (double)m[7]) / d[1];
    *from_axis = hypot((double)m[3] + t * d[0], (double)m[11] + t * d[2]);
    return d[1] < 0.0 && sqrt(nearest) > RADIUS + 0.15;
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* Light from one direction gives a black shadow with an edge, and an alpha that says so. */
TEST(a_sun_throws_the_shadow_of_a_sphere_and_elsewhere_nothing_is_seen)
{
    struct fixture *fixture = *state;
    static const unsigned tracers[] = {TRACER_BVH, TRACER_NAIVE, TRACER_LDC};
    const bool is_long = getenv("FARLIGHT_TEST_LONG") != NULL; /* else path with bvh */
    for (size_t i = is_long ? 0 : COUNT(shading) - 1; i < COUNT(shading); i++)
        for (size_t t = 0; t < (is_long ? COUNT(tracers) : 1); t++) {
            begin(fixture, shading[i]);
            sun(fixture, 3.0f);
            fixture->request.tracing.tracer = tracers[t];
            fixture->request.tracing.primary = t == 0 ? PRIMARY_RASTER : PRIMARY_TRACE;
            fixture->request.tracer_options.ldc.resolution = 256;
            struct frame_result result = fixture_render(fixture);
            uint32_t dark = 0, clear_ = 0;
            for (uint32_t k = 0; k < EDGE * EDGE; k++) {
                double from_axis;
                const float *pixel = fixture_pixel(&result, k % EDGE, k / EDGE);
                if (!ground_at(fixture, k % EDGE + 0.5, k / EDGE + 0.5, &from_axis))
                    continue;
                if (from_axis < RADIUS - 0.05) { /* the sampled structure's edge is off by less */
                    dark++;
                    assert_near(pixel[3], 1.0, 1e-6);
                } else if (from_axis > RADIUS + 0.05) {
                    clear_++;
                    assert_near(pixel[3], 0.0, 1e-6);
                } else {
                    continue;
                }
                assert_near(pixel[0], 0.0, 1e-6);
            }
            assert_true(dark > 20 && clear_ > 500);
            frame_result_finish(&result);
        }
}

/* The share of the environment in the light of a white surface stays unshadowed by whitted. */
TEST(light_without_shadows_is_left_in_a_shadow)
{
    struct fixture *fixture = *state;
    begin(fixture, INTEGRATOR_WHITTED);
    sun(fixture, 3.0f);
    fixture_environment(fixture, 0.5f, 0.5f, 0.5f);
    fixture->request.picture.background = BACKGROUND_ENVIRONMENT;
    struct frame_result result = fixture_render(fixture);
    const double left = 0.5 / (0.5 + 3.0 / PI);
    uint32_t dark = 0;
    for (uint32_t k = 0; k < EDGE * EDGE; k++) {
        double from_axis;
        const float *pixel = fixture_pixel(&result, k % EDGE, k / EDGE);
        if (!ground_at(fixture, k % EDGE + 0.5, k / EDGE + 0.5, &from_axis) || fabs(from_axis - RADIUS) < 0.01)
            continue;
        dark += from_axis < RADIUS;
        assert_near(pixel[0], 0.5 * (from_axis < RADIUS ? left : 1.0), 1e-5);
        assert_near(pixel[3], 1.0, 1e-5);
    }
    assert_true(dark > 20);
    frame_result_finish(&result);
}

/* A sphere takes r^2 h / d^3 of the light of an even sky, the form factor of a place that lies h below its middle,
 * d away (Howell's catalogue, B-12). A ray is blocked or not, so a pixel is off by less than five times its
 * standard error. */
TEST(a_sphere_takes_its_form_factor_of_an_even_sky)
{
    struct fixture *fixture = *state;
    static const enum integrator_kind open_[] = {INTEGRATOR_DISTRIBUTED, INTEGRATOR_PATH, INTEGRATOR_AO};
    enum { SAMPLES = 16 };
    for (size_t i = 0; i < COUNT(open_); i++) {
        begin(fixture, open_[i]);
        fixture_environment(fixture, 0.5f, 0.5f, 0.5f);
        fixture->request.sampling.samples = SAMPLES;
        fixture->request.light.ao_distance = 1000.0f;
        fixture->request.light.ao_rays = 4;
        struct frame_result result = fixture_render(fixture);
        double off = 0.0, darkest = 0.0;
        uint32_t count = 0;
        for (uint32_t k = 0; k < EDGE * EDGE; k++) {
            double from_axis;
            if (!ground_at(fixture, k % EDGE + 0.5, k / EDGE + 0.5, &from_axis))
                continue;
            const double distance = hypot(from_axis, HEIGHT);
            const double taken = RADIUS * RADIUS * HEIGHT / (distance * distance * distance);
            const double alpha = (double)fixture_pixel(&result, k % EDGE, k / EDGE)[3];
            assert_near(alpha, taken, 5.0 * sqrt(0.25 / (4 * SAMPLES)));
            off += alpha - taken;
            darkest = fmax(darkest, taken);
            count++;
        }
        assert_true(count > 500 && darkest > 0.2);
        assert_near(off / count, 0.0, 5.0 * sqrt(0.25 / (4 * SAMPLES * count)));
        frame_result_finish(&result);
    }
}

/* The sphere, a mirror, does not see it, and the ground does not light it. */
TEST(what_is_above_the_ground_looks_the_same_without_it)
{
    struct fixture *fixture = *state;
    for (size_t i = 0; i < COUNT(shading); i++) {
        begin(fixture, shading[i]);
        sun(fixture, 3.0f);
        fixture_environment(fixture, 0.3f, 0.5f, 0.7f);
        fixture->request.sampling.samples = 4;
        struct frame_result with = fixture_render(fixture);
        fixture->request.ground.radius = 0.0f;
        struct frame_result without = fixture_render(fixture);
        uint32_t covered = 0;
        for (uint32_t k = 0; k < EDGE * EDGE; k++) {
            const float *a = fixture_pixel(&with, k % EDGE, k / EDGE);
            const float *b = fixture_pixel(&without, k % EDGE, k / EDGE);
            if (b[3] < 1.0f)
                continue;
            covered++;
            assert_memory_equal(a, b, 4 * sizeof(float));
        }
        assert_true(covered > 50);
        frame_result_finish(&with);
        frame_result_finish(&without);
    }
}

TEST(a_ground_is_not_there_from_below_without_light_or_for_raycast)
{
    struct fixture *fixture = *state;
    for (int k = 0; k < 3; k++) {
        begin(fixture, k == 2 ? INTEGRATOR_RAYCAST : INTEGRATOR_DISTRIBUTED);
        sun(fixture, k == 1 ? 0.0f : 3.0f);
        if (k == 0)
            fixture_set_camera(fixture, 0.0f, -2.0f, 4.5f, 0.7f);
        struct frame_result with = fixture_render(fixture);
        fixture->request.ground.radius = 0.0f;
        struct frame_result without = fixture_render(fixture);
        assert_same_picture(&with, &without);
        frame_result_finish(&with);
        frame_result_finish(&without);
    }
}
