/* SPDX-License-Identifier: MIT */
/* The rows of a check, and what fails one. */
#include "check/check.h"
#include "check/scene.h"
#include "check/tracers.h"
#include "protocol/tracers.h"
#include "tests/fixtures/device.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/harness/test.h"
#include "trace/tracer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

ALL_TESTS(open_device, close_device)

/* Output of a report. */
struct written {
    char *text;
    size_t bytes;
    struct check_report report;
};

static void written_init(struct written *written, bool json)
{
    *written = (struct written){.report.json = json};
    written->report.stream = open_memstream(&written->text, &written->bytes);
    assert_non_null(written->report.stream);
}

static void written_finish(struct written *written)
{
    fclose(written->report.stream);
    free(written->text);
}

static void assert_has(const struct written *written, const char *text)
{
    if (!strstr(written->text, text))
        fail_msg("no \"%s\" in: %s", text, written->text);
}

/* ---- rows ---- */

TEST(a_row_is_an_object_on_a_line_whatever_a_driver_is_called)
{
    struct written written;
    written_init(&written, true);
    check_report_row(&written.report,
                     &(struct check_row){.verdict = CHECK_FAILED,
                                         .check = "limit",
                                         .name = "a \"driver\"\\\n\x1b[31m",
                                         .unit = "ms",
                                         .value = 1.5,
                                         .bound = NAN,
                                         .remedy = "do this"},
                     "%d of %d", 1, 2);
    assert_string_equal(
        written.text,
        "{\"check\":\"limit\",\"name\":\"a \\\"driver\\\"\\\\??[31m\",\"verdict\":\"failed\","
        "\"value\":1.5,\"bound\":null,\"unit\":\"ms\",\"text\":\"1 of 2\",\"remedy\":\"do this\"}\n");
    written_finish(&written);
}

TEST(rows_that_fail_are_counted_and_notes_are_not)
{
    struct written written;
    struct error error = {.text = "what is wrong", .remedy = "what to do"};
    written_init(&written, false);
    check_report_row(&written.report, &(struct check_row){CHECK_NOTE, "a", "b", .bound = NAN}, "told");
    check_report_row(&written.report, &(struct check_row){CHECK_OK, "c", "d", .bound = NAN}, "good");
    assert_int_equal(written.report.failed, 0);
    check_report_error(&written.report, "e", "f", &error);
    assert_true(check_report_end(&written.report));
    assert_has(&written, "what is wrong\n        -> what to do\n");
    assert_has(&written, "1 of 3\n");
    written_finish(&written);
}

TEST(a_device_that_cannot_be_opened_fails_the_check)
{
    struct written written;
    written_init(&written, true);
    const struct check_options options = {.gpu = {.index = 1000}, .stream = written.report.stream, .json = true};
    gpu_device_destroy(device);
    assert_int_equal(check_device(&options), CHECK_SOME_FAIL);
    assert_has(&written, "\"verdict\":\"failed\"");
    assert_has(&written, "device 1000 does not exist");
    written_finish(&written);
    open_device(NULL);
}

/* ---- a tracer that is wrong ---- */

static bool trace_nothing(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                          const struct ray_range *rays, struct error *error)
{
    if (!tracer_bvh_impl.trace_range(tracer, scene, state, rays, error))
        return false;
    if (state->wave.kind == WAVE_CLOSEST && rays->first == 0) { /* some hits of each wave are lost */
        const struct hit lost = {.distance = -1};
        gpu_buffer_write(tracer->device, state->wave.hits, (size_t)(state->wave.ray_count / 2) * sizeof(lost),
                         &lost, sizeof(lost));
        for (uint32_t i = 0; i < state->wave.ray_count; i += 100)
            gpu_buffer_write(tracer->device, state->wave.hits, i * sizeof(lost), &lost, sizeof(lost));
    }
    return true;
}

static void expect_rays(const struct tracer_impl *stand_in, enum check_verdict verdict)
{
    struct written written;
    struct check_frames frames;
    struct error error = {0};
    written_init(&written, false);
    if (!check_frames_init(&frames, device, check_scene_small(&error), &error))
        fail_msg("%s", error.text);
    frame_renderer_stand_in(frames.renderer, TRACER_BVH, stand_in);
    assert_true(check_rays(&written.report, &frames, TRACER_BVH));
    if (written.report.failed != (verdict == CHECK_FAILED))
        fail_msg("%u rows failed: %s", written.report.failed, written.text);
    check_frames_finish(&frames);
    written_finish(&written);
}

TEST(a_tracer_that_agrees_with_the_reference_passes)
{
    expect_rays(NULL, CHECK_OK);
}

TEST(a_tracer_that_loses_one_ray_in_a_hundred_fails)
{
    struct tracer_impl wrong = tracer_bvh_impl;
    wrong.trace_range = trace_nothing;
    expect_rays(&wrong, CHECK_FAILED);
}

TEST(a_tracer_without_memory_fails_with_its_error)
{
    struct written written;
    struct check_frames frames;
    struct error error = {0};
    const uint64_t limit = device->memory_limit_bytes;
    written_init(&written, false);
    device->memory_limit_bytes = device->memory_used_bytes + (1 << 20);
    assert_true(check_frames_init(&frames, device, check_scene_small(&error), &error));
    assert_false(check_rays(&written.report, &frames, TRACER_BVH));
    assert_int_equal(written.report.failed, 1);
    device->memory_limit_bytes = limit;
    check_frames_finish(&frames);
    written_finish(&written);
}
