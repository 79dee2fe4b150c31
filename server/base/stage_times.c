/* SPDX-License-Identifier: MIT */
/* Spans of a frame's stages. */
#include "base/stage_times.h"

#include "base/clock.h"

#include <string.h>

#define WAVE_NUMBER_MAX UINT16_MAX /* the protocol's */

void stage_times_begin(struct stage_times *times)
{
    times->origin_ns = clock_now_ns();
    times->count = 0;
}

static struct record_stage_time *last_of(struct stage_times *times, uint32_t count, enum stage stage,
                                         enum clock clock)
{
    for (uint32_t i = count; i-- > 0;) {
        if (times->spans[i].stage == stage && times->spans[i].clock == clock)
            return &times->spans[i];
    }
    return NULL;
}

/* Merges the last span of a repeated kind into the span before it. There is one, as there are few kinds. */
static void merge_last(struct stage_times *times)
{
    for (uint32_t i = times->count; i-- > 0;) {
        struct record_stage_time *span = &times->spans[i];
        struct record_stage_time *before = last_of(times, i, (enum stage)span->stage, (enum clock)span->clock);
        if (!before)
            continue;
        before->duration_ns += span->duration_ns;
        memmove(span, span + 1, (--times->count - i) * sizeof(*span));
        return;
    }
}

void stage_times_add(struct stage_times *times, enum stage stage, enum clock clock, uint32_t wave,
                     uint64_t start_ns, uint64_t duration_ns)
{
    if (!times)
        return;
    if (times->count == STAGE_SPANS_MAX) {
        struct record_stage_time *last = last_of(times, times->count, stage, clock);
        if (last) {
            last->duration_ns += duration_ns;
            return;
        }
        merge_last(times);
    }
    /* Spans from before the frame's start (edits that it waited for) begin at its origin. */
    uint64_t since_origin_ns = start_ns > times->origin_ns ? start_ns - times->origin_ns : 0;
    times->spans[times->count++] = (struct record_stage_time){
        .stage = stage,
        .clock = clock,
        .wave = wave < WAVE_NUMBER_MAX ? wave : WAVE_NUMBER_MAX,
        .start_ns = since_origin_ns,
        .duration_ns = duration_ns,
    };
}

uint64_t stage_times_sum_ns(const struct stage_times *times, enum stage stage, enum clock clock)
{
    uint64_t sum_ns = 0;
    for (uint32_t i = 0; i < times->count; i++) {
        if (times->spans[i].stage == stage && times->spans[i].clock == clock)
            sum_ns += times->spans[i].duration_ns;
    }
    return sum_ns;
}

const char *stage_name(enum stage stage)
{
    static const char *const names[STAGE_COUNT] = {
        [STAGE_APPLY] = "apply",     [STAGE_BUILD] = "build",       [STAGE_UPLOAD] = "upload",
        [STAGE_PRIMARY] = "primary", [STAGE_TRACE] = "trace",       [STAGE_SHADE] = "shade",
        [STAGE_RESOLVE] = "resolve", [STAGE_READBACK] = "readback", [STAGE_ENCODE] = "encode",
        [STAGE_QUEUE] = "queue",     [STAGE_SEND] = "send",         [STAGE_FRAME] = "frame",
        [STAGE_COMPARE] = "compare",
    };
    return (unsigned)stage < STAGE_COUNT ? names[stage] : "unknown";
}
