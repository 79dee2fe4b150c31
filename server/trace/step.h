/* SPDX-License-Identifier: MIT */
/* Work in steps: other jobs get their turn between two of them, and a cancel is served. */
#ifndef FARLIGHT_TRACE_STEP_H
#define FARLIGHT_TRACE_STEP_H

#include "base/clock.h"

#include <stdbool.h>
#include <stdint.h>

/* Target time of a step: a cancel must be answered within 50 ms, including work that cannot be divided. */
#define STEP_NS UINT64_C(10000000)
#define STEP_WITHOUT_END UINT64_MAX
/* Target time of a batch of items of unknown cost; a step has a few batches. */
#define STEP_BATCH_NS UINT64_C(4000000)

enum tracer_progress { TRACER_FAILED, TRACER_MORE, TRACER_DONE };

static inline enum tracer_progress tracer_progress_of(bool good)
{
    return good ? TRACER_DONE : TRACER_FAILED;
}

/* Whether the step has ended; times are those of clock_now_ns(). */
static inline bool step_is_over(uint64_t step_end_ns)
{
    return step_end_ns != STEP_WITHOUT_END && clock_now_ns() >= step_end_ns;
}

/* Number of items for the next batch, from the time that the last one's `items` took. It at most doubles: the
 * next items may cost more. */
static inline uint32_t step_batch_items(uint32_t items, uint64_t took_ns)
{
    const uint64_t fitting = items * STEP_BATCH_NS / (took_ns + 1), maximum = 2 * (uint64_t)items;
    const uint64_t next = fitting < maximum ? fitting : maximum;
    return next < 1 ? 1 : next < UINT32_MAX / 2 ? (uint32_t)next : UINT32_MAX / 2;
}

#endif
