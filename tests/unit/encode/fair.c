/* SPDX-License-Identifier: MIT */
/* Frames that take long to encode: they keep no other client's frames waiting, and are given up with their job. */
#include "engine/encode_pool.h"

#include "tests/harness/test.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

#define LARGE 2048u /* noise of 2048 x 2048 takes zstd's highest level several seconds */
#define SMALL 16u
/* Processor time that counts as little, whatever else the processors do: far more than a step of a few
 * milliseconds, far less than one large frame, under any sanitizer. */
#define LITTLE_NS UINT64_C(2000000000)

static uint64_t processor_ns(void)
{
    struct timespec used;
    assert_int_equal(clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used), 0);
    return (uint64_t)used.tv_sec * 1000000000 + (uint64_t)used.tv_nsec;
}

static void on_done(void *context)
{
    (void)context;
}

static struct engine_frame *new_frame(uint32_t edge, enum encoding encoding)
{
    struct engine_frame *frame = calloc(1, sizeof(*frame));
    assert_non_null(frame);
    frame->encoding = encoding;
    frame->quality = 19;
    frame->result = (struct frame_result){.width = edge, .height = edge, .layers = 1};
    frame->result.size_bytes = (size_t)4 * edge * edge;
    frame->result.pixels = malloc(frame->result.size_bytes);
    assert_non_null(frame->result.pixels);
    uint32_t noise = 1;
    for (size_t i = 0; i < frame->result.size_bytes; i++) {
        noise = noise * 1664525 + 1013904223;
        frame->result.pixels[i] = (uint8_t)(noise >> 29); /* eight values: there is something to be found */
    }
    return frame;
}

struct fixture {
    struct queue *events;
    struct stage_totals totals;
    struct encode_pool *pool;
    struct job_output *outputs[2]; /* outputs of two clients */
};

static void begin(struct fixture *fixture, unsigned threads)
{
    struct error error = {0};
    *fixture = (struct fixture){.events = queue_create(64, false)};
    fixture->pool = encode_pool_create(
        &(struct encode_pool_options){.threads = threads, .totals = &fixture->totals, .on_done = on_done}, &error);
    for (uint64_t client = 0; client < 2; client++)
        fixture->outputs[client] = job_output_create(&(struct job_output_options){
            .events = fixture->events, .client = client, .window = 32, .credit = UINT64_MAX});
    assert_true(fixture->events && fixture->pool && fixture->outputs[0] && fixture->outputs[1]);
}

static void submit(struct fixture *fixture, unsigned client, uint32_t edge, enum encoding encoding)
{
    uint64_t position = job_output_reserve(fixture->outputs[client]);
    assert_true(
        encode_pool_submit(fixture->pool, fixture->outputs[client], NULL, position, new_frame(edge, encoding)));
}

static void drop_event(void *item)
{
    engine_event_destroy(item);
}

static void end(struct fixture *fixture)
{
    encode_pool_destroy(fixture->pool);
    for (int i = 0; i < 2; i++)
        job_output_unref(fixture->outputs[i]);
    queue_destroy(fixture->events, drop_event);
}

TEST(one_clients_large_frames_leave_a_thread_to_others)
{
    for (unsigned threads = 2; threads <= 3; threads++) {
        struct fixture fixture;
        begin(&fixture, threads);
        for (int i = 0; i < 6; i++)
            submit(&fixture, 0, LARGE, ENCODING_ZSTD);
        for (int i = 0; i < 3; i++) {
            submit(&fixture, 1, SMALL, ENCODING_ZSTD);
            struct engine_event *event = queue_pop(fixture.events, 10000000000);
            assert_non_null(event);
            assert_int_equal(event->kind, ENGINE_FRAME);
            assert_int_equal(event->client, 1);
            engine_event_destroy(event);
        }
        end(&fixture);
    }
}

TEST(frames_are_given_up_with_their_job_and_with_the_pool)
{
    static const enum encoding encodings[] = {ENCODING_ZSTD, ENCODING_PREDICTED};
    for (int i = 0; i < 2; i++) {
        struct fixture fixture;
        begin(&fixture, 1);
        submit(&fixture, 0, LARGE, encodings[i]);
        submit(&fixture, 1, SMALL, encodings[i]);
        assert_null(queue_pop(fixture.events, 50000000)); /* the worker is at the large one */
        uint64_t start_ns = processor_ns();
        job_output_close(fixture.outputs[0], NULL);
        struct engine_event *event = queue_pop(fixture.events, 10000000000);
        assert_non_null(event);
        assert_int_equal(event->client, 1);
        engine_event_destroy(event);
        submit(&fixture, 1, LARGE, encodings[i]);
        end(&fixture);
        assert_true(processor_ns() - start_ns < LITTLE_NS);
    }
}
