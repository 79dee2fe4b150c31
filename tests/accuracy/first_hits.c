/* SPDX-License-Identifier: MIT */
/* Whether first hits are rasterised or traced, where that is left to the device. */
#include "tests/accuracy/render_fixture.h"
#include "tests/harness/test.h"

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* As of a device that was measured: primitives a pixel from which tracing is faster. */
static void take_as_measured(float one, float several)
{
    device->measured = (struct gpu_measured){true, {one, several}};
}

static struct frame_result render(struct fixture *fixture, unsigned tracer, enum primary_kind primary)
{
    fixture->request.tracer = tracer;
    fixture->request.tracer_options.ldc.resolution = 64;
    fixture->request.tracer_options.abuffer.resolution = 64;
    fixture->request.primary = primary;
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

TEST(a_device_of_which_nothing_is_known_rasterises)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.samples = 4;
    device->measured = (struct gpu_measured){0};
    assert_chosen(fixture, TRACER_BVH, PRIMARY_RASTER);
}

TEST(bvh_traces_first_hits_where_that_was_measured_to_be_faster)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.samples = 4;
    take_as_measured(1e9f, 0.0f);
    assert_chosen(fixture, TRACER_BVH, PRIMARY_TRACE);
    take_as_measured(0.0f, 1e9f);
    assert_chosen(fixture, TRACER_BVH, PRIMARY_RASTER);
}

/* 3 spheres, 4 triangles and a disc on 96 x 72 pixels. */
TEST(the_number_of_primitives_a_pixel_decides)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.samples = 4;
    take_as_measured(1e9f, 8.0f / (96 * 72) - 1e-6f);
    assert_chosen(fixture, TRACER_BVH, PRIMARY_TRACE);
    take_as_measured(1e9f, 8.0f / (96 * 72) + 1e-6f);
    assert_chosen(fixture, TRACER_BVH, PRIMARY_RASTER);
}

/* Many primitives a pixel are not enough. */
TEST(software_gl_rasterises_scenes_of_few_primitives)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.samples = 16;
    fixture->request.width = 4;
    fixture->request.height = 3;
    device->measured = (struct gpu_measured){0};
    assert_chosen(fixture, TRACER_BVH, PRIMARY_RASTER);
}

TEST(tracers_that_sample_and_brute_force_keep_rasterised_first_hits)
{
    struct fixture *fixture = *state;
    static const unsigned tracers[] = {TRACER_LDC, TRACER_ABUFFER, TRACER_NAIVE};
    fixture_mixture(fixture);
    fixture->request.samples = 4;
    take_as_measured(0.0f, 0.0f);
    for (size_t i = 0; i < sizeof(tracers) / sizeof(tracers[0]); i++)
        assert_chosen(fixture, tracers[i], PRIMARY_RASTER);
}

TEST(the_reference_traces_its_first_hits_on_every_device)
{
    struct fixture *fixture = *state;
    if (!tracer_impl_by_number(TRACER_REFERENCE)) {
        printf("this build is without Embree\n");
        skip();
    }
    fixture_mixture(fixture);
    fixture->request.samples = 4;
    device->measured = (struct gpu_measured){0};
    assert_chosen(fixture, TRACER_REFERENCE, PRIMARY_TRACE);
}

/* The choice may not change with the number of samples that a frame adds. */
TEST(frames_that_add_up_have_the_choice_of_one_frame_of_all_samples)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    take_as_measured(1e9f, 0.0f); /* several samples are traced, one is not */
    fixture->request.accumulate = true;
    fixture->request.samples = 6;
    struct frame_result whole = render(fixture, TRACER_BVH, PRIMARY_AUTO);
    fixture->request.seed++; /* something else in between */
    fixture->request.samples = 1;
    struct frame_result sum = render(fixture, TRACER_BVH, PRIMARY_AUTO);
    fixture->request.seed--;
    for (uint32_t samples = 1; samples <= 3; samples++) {
        frame_result_finish(&sum);
        fixture->request.samples = samples;
        sum = render(fixture, TRACER_BVH, PRIMARY_AUTO);
    }
    assert_int_equal(sum.samples, 6);
    assert_same_picture(&whole, &sum);
    frame_result_finish(&whole);
    frame_result_finish(&sum);
}
