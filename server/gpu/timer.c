/* SPDX-License-Identifier: MIT */
/* A ring of timestamp queries. */
#include "gpu/timer.h"

#include "base/clock.h"
#include "gpu/registry.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

/* A frame of eight waves with four lights takes about a hundred spans. */
#define RING_SPANS 256

struct span {
    enum stage stage;
    uint32_t wave;
    uint64_t cpu_start_ns, cpu_duration_ns;
    unsigned queries[2]; /* begin, end; 0: measured by the CPU alone */
};

struct gpu_timer {
    struct gpu_device *device;
    struct span *spans; /* spans since the last collect */
    size_t span_count, span_capacity;
    unsigned queries[RING_SPANS][2];
    size_t next_query, queries_used; /* those of the ring */
    bool open;
};

struct gpu_timer *gpu_timer_create(struct gpu_device *device)
{
    struct gpu_timer *timer = calloc(1, sizeof(*timer));
    if (!timer)
        return NULL;
    timer->device = device;
    for (size_t i = 0; i < RING_SPANS; i++)
        for (size_t end = 0; end < 2; end++)
            timer->queries[i][end] = gpu_object_create(device->registry, GPU_TIMESTAMP_QUERY);
    return timer;
}

void gpu_timer_destroy(struct gpu_timer *timer)
{
    if (!timer)
        return;
    for (size_t i = 0; i < RING_SPANS; i++)
        for (size_t end = 0; end < 2; end++)
            gpu_object_destroy(timer->device->registry, GPU_TIMESTAMP_QUERY, timer->queries[i][end]);
    free(timer->spans);
    free(timer);
}

static struct span *add_span(struct gpu_timer *timer)
{
    if (timer->span_count == timer->span_capacity) {
        size_t capacity = timer->span_capacity ? timer->span_capacity * 2 : 64;
        struct span *spans = realloc(timer->spans, capacity * sizeof(*spans));
        if (!spans)
            return NULL;
        timer->spans = spans;
        timer->span_capacity = capacity;
    }
    struct span *span = &timer->spans[timer->span_count];
    *span = (struct span){0};
    const unsigned *queries = timer->queries[timer->next_query];
    if (timer->queries_used < RING_SPANS && queries[1]) {
        span->queries[0] = queries[0];
        span->queries[1] = queries[1];
        timer->next_query = (timer->next_query + 1) % RING_SPANS;
        timer->queries_used++;
    }
    timer->span_count++;
    return span;
}

void gpu_timer_begin(struct gpu_timer *timer, enum stage stage, uint32_t wave)
{
    if (timer->open)
        gpu_timer_end(timer);
    struct span *span = add_span(timer);
    if (!span)
        return;
    timer->open = true;
    span->stage = stage;
    span->wave = wave;
    span->cpu_start_ns = clock_now_ns();
    if (span->queries[0])
        glQueryCounter(span->queries[0], GL_TIMESTAMP);
}

void gpu_timer_end(struct gpu_timer *timer)
{
    if (!timer->open)
        return;
    timer->open = false;
    struct span *span = &timer->spans[timer->span_count - 1];
    if (span->queries[1])
        glQueryCounter(span->queries[1], GL_TIMESTAMP);
    span->cpu_duration_ns = clock_now_ns() - span->cpu_start_ns;
}

static bool is_available(unsigned query)
{
    GLint available = 0;
    glGetQueryObjectiv(query, GL_QUERY_RESULT_AVAILABLE, &available);
    return available;
}

/* Whether the device has finished the span, if it measures it at all. */
static bool is_done(const struct span *span)
{
    return !span->queries[1] || is_available(span->queries[1]);
}

/* Whether the device has finished all spans, though it may have other work after them. */
static bool all_available(const struct gpu_timer *timer)
{
    for (size_t i = timer->span_count; i-- > 0;)
        if (timer->spans[i].queries[1])
            return is_available(timer->spans[i].queries[1]);
    return false;
}

/* Gets a query's time. False: the query has no result, as after the loss of the context. It waits for a late
 * one: once a query was asked whether it is available, Mesa's zink returns from glFinish() before it is. */
static bool query_time(unsigned query, uint64_t *time_ns)
{
    GLuint64 value = 0;
    glGetQueryObjectui64v(query, GL_QUERY_RESULT, &value);
    *time_ns = value;
    return value != 0;
}

/* Collects the first `count` spans. */
static void collect(struct gpu_timer *timer, size_t count, struct stage_times *times)
{
    /* GPU clock at this moment, to convert its times to the host's. */
    GLint64 gpu_now_ns = 0;
    glGetInteger64v(GL_TIMESTAMP, &gpu_now_ns);
    uint64_t cpu_from_gpu_ns = clock_now_ns() - (uint64_t)gpu_now_ns; /* may wrap, and wraps back */
    for (size_t i = 0; i < count; i++) {
        const struct span *span = &timer->spans[i];
        uint64_t begin_ns, end_ns;
        timer->queries_used -= span->queries[1] != 0;
        stage_times_add(times, span->stage, CLOCK_CPU, span->wave, span->cpu_start_ns, span->cpu_duration_ns);
        if (span->queries[1] && query_time(span->queries[0], &begin_ns) && query_time(span->queries[1], &end_ns) &&
            end_ns >= begin_ns)
            stage_times_add(times, span->stage, CLOCK_GPU, span->wave, begin_ns + cpu_from_gpu_ns,
                            end_ns - begin_ns);
    }
    timer->span_count -= count;
    if (timer->span_count > 0)
        memmove(timer->spans, timer->spans + count, timer->span_count * sizeof(*timer->spans));
}

void gpu_timer_collect(struct gpu_timer *timer, struct stage_times *times)
{
    if (timer->open)
        gpu_timer_end(timer);
    if (!all_available(timer))
        gpu_finish(timer->device);
    collect(timer, timer->span_count, times);
}

size_t gpu_timer_collect_done(struct gpu_timer *timer, struct stage_times *times)
{
    size_t done = 0, closed = timer->span_count - timer->open;
    while (done < closed && is_done(&timer->spans[done]))
        done++;
    if (done > 0)
        collect(timer, done, times);
    return timer->span_count;
}

void gpu_timer_drop(struct gpu_timer *timer)
{
    timer->open = false;
    timer->span_count = timer->queries_used = 0;
}
