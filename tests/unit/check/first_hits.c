/* SPDX-License-Identifier: MIT */
/* Decisions from the times of two ways to first hits. */
#include "check/first_hits.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

ALL_TESTS(open_device, close_device)

/* 1 us a pixel and 2 us a primitive to rasterise; 5 us a pixel to trace. */
static struct first_hits made(uint64_t traced_ns_a_pixel)
{
    struct first_hits hits = {.primitives = 1000, .pixels = 100, .few_ns = 100 * 1000};
    for (int several = 0; several < 2; several++) {
        hits.ns[several][FIRST_HITS_RASTERISED] = 100 * 1000 + 1000 * 2000;
        hits.ns[several][FIRST_HITS_TRACED] = 100 * traced_ns_a_pixel;
    }
    return hits;
}

TEST(tracing_begins_where_it_takes_four_fifths_of_the_time)
{
    const struct first_hits hits = made(5000);
    const struct gpu_measured limits = first_hits_limits(&hits);
    assert_true(limits.known);
    /* 5 us = 0.8 (1 us + n 2 us) */
    assert_true(fabsf(limits.traced_from[0] - 2.625f) < 1e-4f);
    assert_true(limits.traced_from[1] == limits.traced_from[0]);
}

TEST(a_device_that_traces_faster_than_it_fills_pixels_always_traces)
{
    const struct first_hits hits = made(500);
    assert_true(first_hits_limits(&hits).traced_from[0] == 0.0f);
}

TEST(a_device_on_which_primitives_cost_nothing_rasterises)
{
    struct first_hits hits = made(5000);
    hits.few_ns = hits.ns[0][FIRST_HITS_RASTERISED] + 1;
    hits.ns[0][FIRST_HITS_TRACED] = 10 * hits.few_ns;
    const struct gpu_measured limits = first_hits_limits(&hits);
    assert_true(limits.known);
    assert_false(gpu_measured_traces(&limits, false, 1000000000, 1000000));
}

TEST(nodes_of_eight_are_taken_where_they_take_less_than_four_fifths_of_the_time)
{
    struct first_hits hits = made(5000);
    hits.links_ns = 1000;
    hits.eight_ns = 801;
    assert_false(first_hits_limits(&hits).nodes_of_eight);
    hits.eight_ns = 799;
    assert_true(first_hits_limits(&hits).nodes_of_eight);
}

TEST_LONG(both_kinds_of_nodes_are_measured)
{
    struct first_hits hits;
    struct error error = {0};
    if (device->facts.time_stamp_bits == 0) {
        printf("skipped: the device measures no time\n");
        skip();
    }
    if (!first_hits_measure(device, &hits, &error))
        fail_msg("%s", error.text);
    assert_true(hits.links_ns > 0 && hits.eight_ns > 0);
}

TEST(nothing_is_known_without_time_stamps)
{
    const struct first_hits none = {.primitives = 1000, .pixels = 100};
    assert_false(first_hits_limits(&none).known);
}

TEST(what_is_decided_for_a_gpu_holds_at_its_next_start)
{
    char folder[] = "/tmp/farlight-decided-XXXXXX", command[64];
    struct gpu_measured back;
    const struct gpu_device before = *device;
    const struct first_hits first = made(5000), second = made(500);
    assert_non_null(mkdtemp(folder));
    assert_int_equal(setenv("XDG_CACHE_HOME", folder, 1), 0);
    device->info.software = false;
    device->measured = (struct gpu_measured){0};
    assert_true(first_hits_keep(device, &first));
    assert_true(device->measured.known);
    assert_true(gpu_measured_load(&device->info, &back));
    assert_true(back.traced_from[1] == device->measured.traced_from[1]);
    assert_true(first_hits_keep(device, &second)); /* the decision is stored already */
    assert_true(back.traced_from[1] == device->measured.traced_from[1]);
    device->info.software = before.info.software;
    device->measured = before.measured;
    snprintf(command, sizeof(command), "rm -r %s", folder);
    assert_int_equal(system(command), 0);
}

TEST(software_gl_is_not_measured_for_it)
{
    if (!device->info.software) {
        printf("skipped: a GPU is measured for it\n");
        skip();
    }
    const float before = device->measured.traced_from[0];
    first_hits_decide(device);
    assert_true(device->measured.known && device->measured.traced_from[0] == before);
}
