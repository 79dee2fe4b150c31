/* SPDX-License-Identifier: MIT */
/* The daemon's trace file: bounds, names that are no JSON, frames that overlap. */
#include <stddef.h>
#include <stdint.h>

#include "base/timeline.h"
#include "tests/harness/test.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char path[64];

static int make_path(void **state)
{
    (void)state;
    snprintf(path, sizeof(path), "%s/farlight-timeline-XXXXXX", P_tmpdir);
    int fd = mkstemp(path);
    return fd < 0 ? -1 : close(fd);
}

static int remove_path(void **state)
{
    (void)state;
    return unlink(path);
}

static struct timeline *start(uint64_t limit_bytes)
{
    struct error error = {0};
    struct timeline *timeline = timeline_create(path, limit_bytes, &error);
    if (!timeline)
        fail_msg("%s: %s", error.field, error.text);
    return timeline;
}

static void add_frame(struct timeline *timeline, const char *name, uint64_t origin_ns, uint32_t frame)
{
    static struct stage_times times;
    times.origin_ns = origin_ns;
    times.count = 0;
    stage_times_add(&times, STAGE_FRAME, CLOCK_CPU, 0, origin_ns, 1000);
    stage_times_add(&times, STAGE_TRACE, CLOCK_CPU, 2, origin_ns + 100, 300);
    stage_times_add(&times, STAGE_TRACE, CLOCK_GPU, 2, origin_ns + 150, 1234567);
    stage_times_add(&times, STAGE_SEND, CLOCK_CPU, 0, origin_ns + 1000, 5000);
    timeline_frame(timeline, &(struct timeline_frame){
                                 .client = 7, .client_name = name, .job = 3, .frame = frame, .times = &times});
}

static json_t *read_back(void)
{
    json_error_t error;
    json_t *events = json_load_file(path, 0, &error);
    if (!events)
        fail_msg("line %d: %s", error.line, error.text);
    assert_true(json_is_array(events));
    return events;
}

static size_t count_of(const json_t *events, const char *kind)
{
    size_t count = 0, index;
    json_t *event;
    json_array_foreach(events, index, event) count +=
        strcmp(json_string_value(json_object_get(event, "ph")), kind) == 0;
    return count;
}

/* The event of a name and frame. */
static const json_t *find(const json_t *events, const char *name, const char *clock, json_int_t frame)
{
    size_t index;
    json_t *event;
    json_array_foreach(events, index, event)
    {
        const json_t *category = json_object_get(event, "cat");
        if (category && strcmp(json_string_value(json_object_get(event, "name")), name) == 0 &&
            strcmp(json_string_value(category), clock) == 0 &&
            json_integer_value(json_object_get(json_object_get(event, "args"), "frame")) == frame)
            return event;
    }
    fail_msg("no %s of frame %d", name, (int)frame);
    return NULL;
}

static json_int_t thread_of(const json_t *event)
{
    return json_integer_value(json_object_get(event, "tid"));
}

EACH_TEST(make_path, remove_path)

TEST(a_frame_has_its_spans_in_microseconds_with_client_job_and_wave)
{
    struct timeline *timeline = start(1 << 20);
    add_frame(timeline, "somebody", 5000000123, 9);
    timeline_destroy(timeline);
    json_t *events = read_back();
    assert_int_equal(count_of(events, "X"), 4);
    const json_t *event = find(events, "trace", "gpu", 9), *args = json_object_get(event, "args");
    /* Nanoseconds are whole in what is printed; the difference is that of the decimal to a double. */
    assert_true(json_real_value(json_object_get(event, "ts")) - 5000000.273 < 1e-6);
    assert_true(5000000.273 - json_real_value(json_object_get(event, "ts")) < 1e-6);
    assert_true(json_real_value(json_object_get(event, "dur")) - 1234.567 < 1e-9);
    assert_true(1234.567 - json_real_value(json_object_get(event, "dur")) < 1e-9);
    assert_int_equal(json_integer_value(json_object_get(event, "pid")), 7);
    assert_int_equal(json_integer_value(json_object_get(args, "job")), 3);
    assert_int_equal(json_integer_value(json_object_get(args, "wave")), 2);
    assert_int_equal(thread_of(find(events, "frame", "cpu", 9)), thread_of(find(events, "trace", "cpu", 9)));
    assert_int_not_equal(thread_of(event), thread_of(find(events, "trace", "cpu", 9)));
    json_decref(events);
}

TEST(a_name_that_a_client_chose_cannot_break_the_file)
{
    struct timeline *timeline = start(1 << 20);
    add_frame(timeline, "\"}]\\ \n\t\x7f\x01 \xc3\xa9", 1000, 0);
    timeline_destroy(timeline);
    json_t *events = read_back();
    const json_t *name = json_object_get(json_object_get(json_array_get(events, 0), "args"), "name");
    assert_string_equal(json_string_value(name), "client 7 \"}]\\ \n\t\x7f\x01 \xc3\xa9");
    json_decref(events);
}

TEST(frames_that_overlap_without_nesting_get_lanes_of_their_own)
{
    struct timeline *timeline = start(1 << 20);
    add_frame(timeline, "", 1000000, 0);
    add_frame(timeline, "", 1000500, 1); /* while the one before is rendered */
    add_frame(timeline, "", 9000000, 2); /* after all */
    timeline_destroy(timeline);
    json_t *events = read_back();
    const json_int_t first = thread_of(find(events, "frame", "cpu", 0));
    assert_int_not_equal(thread_of(find(events, "frame", "cpu", 1)), first);
    assert_int_equal(thread_of(find(events, "frame", "cpu", 2)), first);
    assert_int_not_equal(thread_of(find(events, "send", "cpu", 1)), thread_of(find(events, "send", "cpu", 0)));
    json_decref(events);
}

TEST(the_file_never_grows_past_its_limit_and_stays_valid)
{
    for (uint64_t limit_bytes = 0; limit_bytes < 4096; limit_bytes += 61) {
        struct timeline *timeline = start(limit_bytes);
        for (uint32_t i = 0; i < 20; i++)
            add_frame(timeline, "x", 1000 + i * 10000000, i);
        timeline_destroy(timeline);
        struct stat status;
        assert_int_equal(stat(path, &status), 0);
        if (limit_bytes >= 8) /* the brackets of an empty array */
            assert_in_range(status.st_size, 1, limit_bytes);
        json_decref(read_back());
    }
}

TEST(without_any_frame_it_is_an_empty_array)
{
    timeline_destroy(start(1 << 20));
    json_t *events = read_back();
    assert_int_equal(json_array_size(events), 0);
    json_decref(events);
    timeline_frame(NULL, NULL); /* no file is wanted */
    timeline_destroy(NULL);
}
