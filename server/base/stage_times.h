/* SPDX-License-Identifier: MIT */
/* Stage times of a frame. Every stage of the pipeline reports here. */
#ifndef FARLIGHT_BASE_STAGE_TIMES_H
#define FARLIGHT_BASE_STAGE_TIMES_H

#include "base/words.h"
#include "protocol/values.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Maximum of spans, as the wire carries 512; further spans are added to the last one of the same stage and
 * clock. */
#define STAGE_SPANS_MAX 512

struct stage_times {
    uint64_t origin_ns; /* clock_now_ns() at the frame's start */
    uint32_t count;
    struct record_stage_time spans[STAGE_SPANS_MAX];
};

void stage_times_begin(struct stage_times *times); /* empties it, sets the origin to now */
/* Adds a span; `start_ns` by clock_now_ns(). `times` may be NULL: nothing happens. */
void stage_times_add(struct stage_times *times, enum stage stage, enum clock clock, uint32_t wave,
                     uint64_t start_ns, uint64_t duration_ns);
uint64_t stage_times_sum_ns(const struct stage_times *times, enum stage stage, enum clock clock);
const char *stage_name(enum stage stage);

#endif
