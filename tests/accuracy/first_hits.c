/* SPDX-License-Identifier: MIT */
/* Whether first hits are rasterised or traced, where that is left to the device. */
#include "tests/accuracy/render_fixture.h"
#include "tests/harness/test.h"

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* Sets the result of a device's measurement: primitives per pixel from which tracing is faster. */
static void take_as_measured(float one, float several)
{
    device->measured = (struct gpu_measured){.known = true, .traced_from = {one, several}};
}

static struct frame_result render(struct fixture *fixture, unsigned tracer, enum primary_kind primary)
{
    fixture->request.tracing.tracer = tracer;
    fixture->request.tracer_options.ldc.resolution = 64;
    fixture->request.tracer_options.abuffer.resolution = 64;
    fixture->request.tracing.primary = primary;
    return fixture_render(fixture);
}

static void assert_chosen(struct fixture *fixture, unsigned tracer, enum primary_kind expected)
{
    struct frame_result chosen = render(fixture, tracer, PRIMARY_AUTO), forced = render(fixture, tracer, expected),
                        other =
                            render(fixture, tracer, expected == PRIMARY_TRACE ? PRIMARY_RASTER : PRIMARY_TRACE);
    assert_same_picture(&chosen, &forced);
    if (memcmp(chosen.pixels, other.pixels, chosen.size_bytes) == 0)
        fail_msg("tracer %u: both ways give the same picture, which says nothing", tracer);
    frame_result_finish(&chosen);
    frame_result_finish(&forced);
    frame_result_finish(&other);
}

#define MIXTURE_SHARE (8.0f / (96 * 72)) /* 3 spheres, 4 triangles and a disc on so many pixels */

/* `one`, `several`: primitives a pixel from which tracing was measured to be faster, of one sample and of several.
 */
static const struct {
    unsigned tracer;
    bool measured;
    float one, several;
    uint32_t samples, width, height;
    enum primary_kind expected;
} rows[] = {
    {TRACER_BVH, false, 0.0f, 0.0f, 4, 96, 72, PRIMARY_RASTER},
    {TRACER_BVH, true, 1e9f, 0.0f, 4, 96, 72, PRIMARY_TRACE},
    {TRACER_BVH, true, 0.0f, 1e9f, 4, 96, 72, PRIMARY_RASTER},
    {TRACER_BVH, true, 1e9f, MIXTURE_SHARE - 1e-6f, 4, 96, 72, PRIMARY_TRACE},
    {TRACER_BVH, true, 1e9f, MIXTURE_SHARE + 1e-6f, 4, 96, 72, PRIMARY_RASTER},
    {TRACER_NAIVE, true, 0.0f, 0.0f, 4, 96, 72, PRIMARY_RASTER},
    {TRACER_LDC, true, 0.0f, 0.0f, 4, 96, 72, PRIMARY_RASTER},
    {TRACER_ABUFFER, true, 0.0f, 0.0f, 4, 96, 72, PRIMARY_RASTER},
    {TRACER_REFERENCE, false, 0.0f, 0.0f, 4, 96, 72, PRIMARY_TRACE},
};

static void expect_choices(struct fixture *fixture, bool of_bvh)
{
    fixture_mixture(fixture);
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        if ((rows[i].tracer == TRACER_BVH) != of_bvh || !tracer_impl_by_number(rows[i].tracer))
            continue;
        take_as_measured(rows[i].one, rows[i].several);
        device->measured.known = rows[i].measured;
        fixture->request.sampling.samples = rows[i].samples;
        fixture->request.picture.width = rows[i].width;
        fixture->request.picture.height = rows[i].height;
        assert_chosen(fixture, rows[i].tracer, rows[i].expected);
    }
}

TEST(bvh_traces_first_hits_where_that_was_measured_to_be_faster)
{
    expect_choices(*state, true);
}

TEST_LONG(tracers_that_sample_rasterise_first_hits_and_the_reference_traces_them)
{
    expect_choices(*state, false);
}

/* The choice may not change with the number of samples that a frame adds. */
TEST(frames_that_add_up_have_the_choice_of_one_frame_of_all_samples)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    take_as_measured(1e9f, 0.0f); /* several samples are traced, one is not */
    fixture->request.sampling.accumulate = true;
    fixture->request.sampling.samples = 6;
    struct frame_result whole = render(fixture, TRACER_BVH, PRIMARY_AUTO);
    fixture->request.sampling.seed++; /* something else in between */
    fixture->request.sampling.samples = 1;
    struct frame_result sum = render(fixture, TRACER_BVH, PRIMARY_AUTO);
    fixture->request.sampling.seed--;
    for (uint32_t samples = 1; samples <= 3; samples++) {
        frame_result_finish(&sum);
        fixture->request.sampling.samples = samples;
        sum = render(fixture, TRACER_BVH, PRIMARY_AUTO);
    }
    assert_int_equal(sum.samples, 6);
    assert_same_picture(&whole, &sum);
    frame_result_finish(&whole);
    frame_result_finish(&sum);
}
