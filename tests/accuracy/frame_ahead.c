/* SPDX-License-Identifier: MIT */
/* Frames whose waves are queued without waiting for their counts, as on a GPU: how often the host waits, and what
 * it does where there is too little room for what was queued. The device is taken for hardware, whatever it is. */
#include "protocol/tracers.h"
#include "shared/layers.h"
#include "render/frame/state.h"
#include "render/passes/layers/layers.h"
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/fixtures/structure.h"
#include "tests/harness/test.h"

#define PANES 24 /* more than the waves that are queued at first */

static struct gpu_facts facts_before;

static int take_for_hardware(void **state)
{
    fixture_setup(state);
    facts_before = device->facts;
    gpu_facts_choose(&device->facts, false);
    return 0;
}

static int take_for_what_it_is(void **state)
{
    device->facts = facts_before;
    return fixture_teardown(state);
}

ALL_TESTS(take_for_hardware, take_for_what_it_is)
EACH_TEST(fixture_clear, NULL)

/* Builds one picture, so that most tests share their programs. */
static void build(struct fixture *fixture)
{
    fixture_mixture(fixture);
    fixture->request.picture.width = 24;
    fixture->request.picture.height = 18;
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.tracing.primary = PRIMARY_TRACE;
    fixture->request.tracer_options.ldc.resolution = fixture->request.tracer_options.abuffer.resolution = 64;
}

/* The second of two frames: the first compiles, and brings the scene to the device. */
static struct frame_result render(struct fixture *fixture, bool ahead)
{
    frame_renderer_queue_ahead(fixture->renderer, ahead);
    struct frame_result first = fixture_render(fixture);
    frame_result_finish(&first);
    return fixture_render(fixture);
}

/* At most one wait, for the one band of a small picture. */
static void assert_ahead_is_as_waiting(struct fixture *fixture, const char *what)
{
    struct frame_result waiting = render(fixture, false), ahead = render(fixture, true);
    if (ahead.device_waits > 1)
        fail_msg("%s: the host waits %u times", what, ahead.device_waits);
    if (waiting.device_waits < 2)
        fail_msg("%s: a frame that waits for its counts does so %u times", what, waiting.device_waits);
    assert_same_picture(&waiting, &ahead);
    assert_int_equal(ahead.primary_rays, waiting.primary_rays);
    assert_int_equal(ahead.shadow_rays, waiting.shadow_rays);
    assert_int_equal(ahead.secondary_rays, waiting.secondary_rays);
    assert_int_equal(ahead.splits, waiting.splits);
    frame_result_finish(&waiting);
    frame_result_finish(&ahead);
}

TEST(the_host_waits_once_for_a_picture_that_is_the_same)
{
    struct fixture *fixture = *state;
    build(fixture);
    assert_ahead_is_as_waiting(fixture, "whitted, bvh");
}

TEST_LONG(the_host_waits_once_whatever_the_integrator_tracer_and_layers)
{
    struct fixture *fixture = *state;
    static const struct {
        unsigned integrator, depth, samples;
    } forms[] = {{INTEGRATOR_WHITTED, 4, 1},
                 {INTEGRATOR_DISTRIBUTED, 4, 4},
                 {INTEGRATOR_PATH, 4, 3},
                 {INTEGRATOR_AO, 1, 2},
                 {INTEGRATOR_RAYCAST, 4, 1}};
    static const unsigned tracers[] = {TRACER_NAIVE, TRACER_BVH, TRACER_LDC, TRACER_ABUFFER, TRACER_RAYSPACE};
    build(fixture);
    for (size_t i = 0; i < sizeof(forms) / sizeof(forms[0]); i++)
        for (size_t k = 0; k < sizeof(tracers) / sizeof(tracers[0]); k++) {
            char what[64];
            fixture->request.light.integrator = forms[i].integrator;
            fixture->request.light.depth = forms[i].depth;
            fixture->request.sampling.samples = forms[i].samples;
            fixture->request.tracing.tracer = tracers[k];
            fixture->request.tracing.primary = (i + k) % 2 ? PRIMARY_TRACE : PRIMARY_RASTER;
            snprintf(what, sizeof(what), "integrator %u, tracer %u", forms[i].integrator, tracers[k]);
            assert_ahead_is_as_waiting(fixture, what);
        }
    fixture->request.picture.layers = LAYER_BITS_SEEN | LAYER_BITS_CRYPTO;
    assert_ahead_is_as_waiting(fixture, "all layers");
    fixture->request.picture.layers = LAYER_BITS_SEEN | LAYER_BITS_LIGHT;
    fixture->request.light.integrator = INTEGRATOR_PATH;
    assert_ahead_is_as_waiting(fixture, "layers of light");
}

/* Only the device knows how many rays there are. Slices have other sizes where they are queued: a hierarchy of its
 * own each, so tests differ a little. */
TEST_LONG(what_a_tracer_counts_of_the_waves_comes_with_the_picture)
{
    struct fixture *fixture = *state;
    build(fixture);
    fixture->request.picture.width = 48;
    fixture->request.picture.height = 36;
    fixture->request.tracing.tracer = TRACER_RAYSPACE;
    static const char *const kinds[RAY_COUNT] = {"primary", "secondary", "shadow"};
    for (uint32_t mode = RAYSPACE_MODE_JOINT; mode <= RAYSPACE_MODE_FLAT; mode++) {
        fixture->request.tracer_options.rayspace.mode = mode;
        struct frame_result waiting = render(fixture, false), ahead = render(fixture, true);
        assert_in_range(ahead.device_waits, 0, 1);
        assert_int_equal(ahead.structure.count, waiting.structure.count);
        for (unsigned kind = 0; kind < RAY_COUNT; kind++) {
            char name[32];
            snprintf(name, sizeof(name), "%s/cone_tests", kinds[kind]);
            const struct structure_row a = structure_row(&waiting.structure, name);
            const struct structure_row b = structure_row(&ahead.structure, name);
            if (!(a.measure > 1) || fabsf(a.measure - b.measure) > 0.1f * a.measure)
                fail_msg("mode %u, %s: %g a ray, and %g where waves are queued", mode, name, (double)a.measure,
                         (double)b.measure);
            assert_int_equal(b.part, 1 + kind);
        }
        frame_result_finish(&waiting);
        frame_result_finish(&ahead);
    }
    fixture->request.tracing.primary = PRIMARY_RASTER;
    struct frame_result rasterised = render(fixture, true);
    assert_int_equal(structure_row(&rasterised.structure, "primary/waves").number, 0);
    assert_in_range(structure_row(&rasterised.structure, "shadow/waves").number, 1, 1000);
    frame_result_finish(&rasterised);
}

TEST(a_slice_that_overflows_on_the_device_is_done_again_in_order)
{
    struct fixture *fixture = *state;
    build(fixture);
    for (unsigned samples = 1; samples <= 3; samples += 2) {
        fixture->request.sampling.samples = samples;
        frame_renderer_set_capacity(fixture->renderer, 0, 0);
        struct frame_result whole = render(fixture, false);
        frame_renderer_set_capacity(fixture->renderer, 128, 128);
        struct frame_result split = render(fixture, true);
        assert_true(split.splits > 0);
        assert_same_picture(&whole, &split);
        assert_int_equal(split.secondary_rays, whole.secondary_rays);
        assert_int_equal(split.shadow_rays, whole.shadow_rays);
        frame_result_finish(&split);
        frame_result_finish(&whole);
    }
}

TEST(one_pixel_that_overflows_gets_larger_buffers)
{
    struct fixture *fixture = *state;
    build(fixture);
    fixture->request.picture.width = 6;
    fixture->request.picture.height = 4;
    struct frame_result whole = render(fixture, false);
    frame_renderer_set_capacity(fixture->renderer, 1, 1);
    struct frame_result grown = render(fixture, true);
    assert_true(grown.splits > 0);
    assert_same_picture(&whole, &grown);
    frame_result_finish(&whole);
    frame_result_finish(&grown);
}

/* More waves than the depth says, as none of these rays counts as a bounce. */
TEST(rays_behind_the_last_queued_wave_are_not_lost)
{
    struct fixture *fixture = *state;
    struct scene_material *pane = fixture_material(fixture);
    pane->value.alpha_mode = ALPHA_BLEND;
    pane->value.base_colour[3] = 0.1f;
    for (int i = 0; i < PANES; i++) {
        const float at[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -0.05f * (float)i};
        fixture_square(fixture, 1.0f, pane->base.id, at);
    }
    fixture_environment(fixture, 0.5f, 0.5f, 0.5f);
    fixture->request.light.depth = 1;
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.light.integrator = INTEGRATOR_RAYCAST;
    fixture->request.light.layer_opacity = 0.1f;
    struct frame_result waiting = render(fixture, false), ahead = render(fixture, true);
    assert_same_picture(&waiting, &ahead);
    assert_int_equal(ahead.secondary_rays, waiting.secondary_rays);
    assert_true(waiting.secondary_rays >= PANES);
    frame_result_finish(&waiting);
    frame_result_finish(&ahead);
}

TEST(a_frame_that_is_given_up_leaves_nothing_behind)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    build(fixture);
    struct frame_result whole = render(fixture, false);
    frame_renderer_queue_ahead(fixture->renderer, true);
    frame_renderer_set_capacity(fixture->renderer, 128, 128);
    for (unsigned steps = 1; steps < 40; steps += 6) {
        struct frame_result none = {0};
        assert_true(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
        for (unsigned i = 0; i < steps; i++)
            assert_int_equal(frame_step(fixture->renderer, &none, &error), FRAME_MORE);
        frame_abandon(fixture->renderer);
        struct frame_result after = fixture_render(fixture);
        assert_same_picture(&whole, &after);
        frame_result_finish(&after);
    }
    frame_result_finish(&whole);
}

static unsigned steps_of(struct fixture *fixture, uint64_t step_ns, struct frame_result *result)
{
    struct error error = {0};
    unsigned steps = 0;
    enum frame_progress progress = FRAME_MORE;
    frame_scene_set_step(fixture->shared, step_ns);
    frame_result_finish(result);
    if (!frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error))
        fail_msg("frame_begin: %s", error.text);
    for (; progress == FRAME_MORE; steps++)
        progress = frame_step(fixture->renderer, result, &error);
    if (progress != FRAME_DONE)
        fail_msg("frame_step: %s", error.text);
    return steps;
}

/* By its time stamps: no slice is as short as a nanosecond, each is shorter than a second. */
TEST_LONG(slices_are_as_large_as_the_device_can_do_in_a_step)
{
    struct fixture *fixture = *state;
    struct frame_result large = {0}, small = {0};
    fixture_mixture(fixture);
    fixture_commit(fixture);
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.light.integrator = INTEGRATOR_RAYCAST;
    fixture->request.light.depth = 0;
    fixture->request.picture.width = 512;
    fixture->request.picture.height = 512;
    unsigned few = 0, many = 0;
    for (int i = 0; i < 2; i++) /* learnt from picture to picture */
        many = steps_of(fixture, 1, &small);
    for (int i = 0; i < 3; i++)
        few = steps_of(fixture, 4000000000u, &large);
    /* 2^18 rays in slices of 2^12, and in one: the steps of 63 slices more, at least three each. */
    assert_true(many >= few + 3 * 63);
    assert_same_picture(&large, &small);
    frame_result_finish(&large);
    frame_result_finish(&small);
}

/* Rays that may have a handful of elements in a dispatch: the slice stops on the device, and is done again with as
 * many dispatches as its rays need. */
TEST(rays_that_take_too_long_for_a_dispatch_are_traced_in_several)
{
    struct fixture *fixture = *state;
    build(fixture);
    struct frame_result expected = render(fixture, true);
    const uint32_t tests = fixture->device->facts.ray_tests_max;
    fixture->device->facts.ray_tests_max = 5;
    struct frame_result got = render(fixture, true);
    fixture->device->facts.ray_tests_max = tests;
    assert_same_picture(&expected, &got);
    assert_int_equal(got.shadow_rays, expected.shadow_rays);
    assert_int_equal(got.secondary_rays, expected.secondary_rays);
    assert_in_range(expected.device_waits, 0, 1);
    if (got.device_waits < 5)
        fail_msg("the host waited %u times", got.device_waits);
    frame_result_finish(&expected);
    frame_result_finish(&got);
}

/* The number for a picture in one slice, which is learnt from picture to picture. Its waves may have 2^19 rays, as
 * mirrors and glass may send on several for each: few are there, and no dispatch is for those that are not. */
static uint32_t dispatches_of(struct fixture *fixture, enum integrator_kind integrator)
{
    struct frame_result result = {0};
    fixture->request.light.integrator = integrator;
    for (int i = 0; i < 3; i++)
        (void)steps_of(fixture, 4000000000u, &result);
    const uint32_t dispatches = result.dispatches;
    assert_in_range(result.barriers, 1, dispatches + 20); /* and what draws wait for */
    frame_result_finish(&result);
    return dispatches;
}

#define BOUNCES 8u
#define PASSES_A_WAVE 16u /* 13 to 15, and the picture's own */

TEST_LONG(a_slice_has_no_dispatches_but_those_of_its_passes)
{
    struct fixture *fixture = *state;
    build(fixture);
    fixture_commit(fixture);
    fixture->request.picture.width = fixture->request.picture.height = 512;
    fixture->request.light.depth = BOUNCES;
    const uint32_t whitted = dispatches_of(fixture, INTEGRATOR_WHITTED);
    const uint32_t path = dispatches_of(fixture, INTEGRATOR_PATH); /* which goes straight on as often, too */
    if (whitted > PASSES_A_WAVE * (1 + BOUNCES) || path > PASSES_A_WAVE * (1 + 2 * BOUNCES))
        fail_msg("whitted has %u dispatches, path %u", whitted, path);
}

/* Their waves' buffers take a part of the memory, and are buffer textures. */
TEST(slices_are_no_larger_than_the_device_has_memory_and_texels_for)
{
    struct fixture *fixture = *state;
    const struct gpu_facts facts = device->facts;
    static const struct {
        const char *what;
        uint64_t memory_bytes, texels;
        uint32_t rays;
    } rows[] = {{"nothing is short", (uint64_t)8 << 30, 1u << 27, 1u << 14}, /* the whole picture fits */
                {"memory is not told", 0, 1u << 27, 1u << 14},
                {"little memory", (uint64_t)256 << 20, 1u << 27, 1u << 13},
                {"no more texels than OpenGL promises", (uint64_t)8 << 30, 1u << 16, 1u << 13},
                {"hardly any memory", 1 << 20, 1u << 27, 1u << 12}};
    build(fixture);
    fixture->request.picture.width = fixture->request.picture.height = 128;
    fixture->request.light.depth = 0;
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        device->facts.memory.bytes = rows[i].memory_bytes;
        device->facts.texture_buffer_texels_max = rows[i].texels;
        struct frame_result result = fixture_render(fixture);
        if (fixture->renderer->slice_rays_max != rows[i].rays)
            fail_msg("%s: slices of %u rays", rows[i].what, fixture->renderer->slice_rays_max);
        frame_result_finish(&result);
    }
    device->facts = facts;
}
