/* SPDX-License-Identifier: MIT */
/* The integrator `ao` against closed forms of how open a place is, with and without falloff, and how its rays are
 * cut into batches, frames and requests that are refused. */
#include "tests/accuracy/render_fixture.h"
#include "tests/harness/test.h"

#define FAR_AWAY 1000.0f
static const unsigned tracers[] = {TRACER_BVH, TRACER_NAIVE, TRACER_REFERENCE};
#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

enum { EDGE = 32 };

/* bvh, or all. */
static size_t tracer_count(void)
{
    return getenv("FARLIGHT_TEST_LONG") ? COUNT(tracers) : 1;
}

static void begin(struct fixture *fixture, unsigned tracer)
{
    fixture_clear((void **)&fixture);
    fixture->request.picture.width = fixture->request.picture.height = EDGE;
    fixture->request.light.integrator = INTEGRATOR_AO;
    fixture->request.sampling.pixel_filter = FILTER_BOX;
    fixture->request.tracing.tracer = tracer;
    fixture->request.tracing.primary = PRIMARY_TRACE;
    fixture->request.light.ao_distance = FAR_AWAY;
}

/* Looks down at the plane z = 0, of which `height` metres are seen. */
static void look_down(struct fixture *fixture, float height)
{
    fixture->request.camera.fov_y = 0.0f;
    fixture->request.camera.ortho_height = height;
}

static double mean_of_columns(const struct frame_result *result, uint32_t first, uint32_t end)
{
    double sum = 0.0;
    for (uint32_t y = 0; y < result->height; y++)
        for (uint32_t x = first; x < end; x++)
            sum += (double)fixture_pixel(result, x, y)[0];
    return sum / ((end - first) * result->height);
}

/* A ray is closed or it is not: so the error of n of them, if they were independent; they are stratified. Five
 * times that is exceeded once in two million. */
static double five_errors(double open, double rays)
{
    return 5.0 * sqrt(open * (1.0 - open) / rays);
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(an_open_plane_and_rays_that_leave_the_scene_are_unoccluded)
{
    struct fixture *fixture = *state;
    for (size_t t = 0; t < tracer_count(); t++) {
        begin(fixture, tracers[t]);
        fixture_square(fixture, 1.0f, fixture_material(fixture)->base.id, NULL);
        fixture->request.sampling.samples = 2;
        struct frame_result result = fixture_render(fixture);
        for (uint32_t i = 0; i < EDGE * EDGE; i++)
            for (int c = 0; c < 3; c++) /* sums of eighths and halves */
                assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[c], 1.0, 1e-6);
        assert_int_equal(result.shadow_rays % 8, 0); /* the default */
        assert_true(result.shadow_rays > 0);
        frame_result_finish(&result);
    }
}

/* A wall 1 m high beside a plane closes (1 - x / sqrt(x^2 + 1)) / 2 of the sky of a place x from it: in the plane
 * across a wall without ends, directions count as the sine of their height. Over a pixel that is integrated. */
TEST(a_wall_hides_its_share_of_the_sky)
{
    struct fixture *fixture = *state;
    const float wall[12] = {0, 0, 1, -2.0f, 0, 1, 0, 0, -1, 0, 0, 0}; /* the square's x is -z here */
    enum { SAMPLES = 16, RAYS = 16 };
    for (size_t t = 0; t < tracer_count(); t++) {
        begin(fixture, tracers[t]);
        uint32_t material = fixture_material(fixture)->base.id;
        fixture_square(fixture, 10.0f, material, NULL);
        struct scene_mesh *mesh = fixture_square(fixture, 1.0f, material, wall);
        float *corners = (float *)(void *)mesh->arrays[MESH_POSITIONS]->data;
        for (int i = 0; i < 4; i++)
            corners[3 * i + 1] *= 400.0f; /* the ends of a wall of 800 m hide less than (1 / 400)^2 */
        look_down(fixture, 4.0f);
        fixture->request.sampling.samples = SAMPLES;
        fixture->request.light.ao_rays = RAYS;
        struct frame_result result = fixture_render(fixture);
        double worst = 0.0;
        for (uint32_t column = 0; column < EDGE; column++) {
            double from = column * 4.0 / EDGE, to = (column + 1) * 4.0 / EDGE;
            double open = 0.5 + 0.5 * (sqrt(to * to + 1.0) - sqrt(from * from + 1.0)) / (to - from);
            double mean = mean_of_columns(&result, column, column + 1);
            assert_near(mean, open, five_errors(open, SAMPLES * RAYS * EDGE) + 1e-5);
            worst = fmax(worst, fabs(mean - open));
        }
        print_message("tracer %u, beside a wall: off by %.1e at most\n", tracers[t], worst);
        frame_result_finish(&result);
    }
}

/* Inside of a ball of radius 1 a direction at cosine c to the normal ends at 2 c, and c^2 is uniform. */
static double open_in_a_ball(double reach, double falloff)
{
    enum { STEPS = 20000 };
    double closed = 0.0;
    for (int i = 0; i < STEPS; i++) {
        double near = 1.0 - 2.0 * sqrt((i + 0.5) / STEPS) / reach;
        closed += near > 0.0 ? pow(near, falloff) / STEPS : 0.0;
    }
    return 1.0 - closed;
}

TEST(nearer_surfaces_occlude_more)
{
    struct fixture *fixture = *state;
    static const float reaches[] = {FAR_AWAY, 3.0f, 2.0f, 1.2f, 0.5f}, falloffs[] = {0.0f, 0.5f, 1.0f, 2.0f, 8.0f};
    enum { SAMPLES = 2, RAYS = 16 };
    begin(fixture, TRACER_BVH);
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 1.0f, fixture_material(fixture)->base.id);
    fixture_set_camera(fixture, 0.0f, 0.0f, 0.3f, 1.0f);
    fixture->request.sampling.samples = SAMPLES;
    fixture->request.light.ao_rays = RAYS;
    for (size_t r = 0; r < COUNT(reaches); r++)
        for (size_t f = 0; f < COUNT(falloffs); f++) {
            fixture->request.light.ao_distance = reaches[r];
            fixture->request.light.ao_falloff = falloffs[f];
            struct frame_result result = fixture_render(fixture);
            double open = open_in_a_ball((double)reaches[r], (double)falloffs[f]);
            double mean = mean_of_columns(&result, 0, EDGE);
            print_message("reach %4g, falloff %3g: %.5f, should be %.5f\n", (double)reaches[r],
                          (double)falloffs[f], mean, open);
            /* Rays begin a little before the surface and end a little before their reach: where that is the
             * diameter, the 8 * 2^-16 of them next to the normal miss, of 32768 these are 4, give or take 2. */
            assert_near(mean, open, five_errors(open, EDGE * EDGE * SAMPLES * RAYS) + 2e-4);
            if (reaches[r] == FAR_AWAY && falloffs[f] == 0.0f)
                assert_near(mean, 0.0, 0.0); /* closed is closed */
            frame_result_finish(&result);
        }
}

/* Half the eye's ray sees the pane, which is half open, and half the light that the pane leaves to the plane
 * 1 m below it. A pane of 400 m hides all but its edge's (1 / 400)^2. */
TEST(blended_panes_count_by_half)
{
    struct fixture *fixture = *state;
    const float above[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1.0f};
    begin(fixture, TRACER_BVH);
    struct scene_material *pane = fixture_material(fixture);
    pane->value.alpha_mode = ALPHA_BLEND;
    pane->value.base_colour[3] = 0.5f;
    fixture_square(fixture, 10.0f, fixture_material(fixture)->base.id, NULL);
    fixture_square(fixture, 400.0f, pane->base.id, above);
    look_down(fixture, 1.0f);
    struct frame_result result = fixture_render(fixture);
    for (uint32_t i = 0; i < EDGE * EDGE; i++) {
        /* alpha and transmittance are in 255 steps */
        assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[0], 0.75, 0.5 / 255.0);
        assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[3], 1.0, 1e-6);
    }
    frame_result_finish(&result);
}

TEST(a_tenth_of_the_diagonal_is_the_default_distance)
{
    struct fixture *fixture = *state;
    begin(fixture, TRACER_BVH);
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 1.0f, fixture_material(fixture)->base.id);
    fixture_set_camera(fixture, 0.0f, 0.0f, 0.3f, 1.0f);
    fixture->request.light.ao_rays = 64;
    fixture->request.light.ao_distance = 0.0f;
    struct frame_result result = fixture_render(fixture);
    double open = open_in_a_ball(sqrt(12.0) / 10.0, 0.0);
    assert_near(mean_of_columns(&result, 0, EDGE), open, five_errors(open, EDGE * EDGE * 64) + 1e-4);
    frame_result_finish(&result);
}
