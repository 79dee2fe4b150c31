/* SPDX-License-Identifier: MIT */
/* Work that is done in pieces, so that others get their turn between two of them and a cancel is served. */
#ifndef FARLIGHT_TRACE_PIECE_H
#define FARLIGHT_TRACE_PIECE_H

#include "base/clock.h"

#include <stdbool.h>
#include <stdint.h>

/* What a piece is to take: a cancel is to be answered within 50 ms, and what cannot be cut comes on top. */
#define PIECE_NS UINT64_C(10000000)
#define PIECE_WITHOUT_END UINT64_MAX
/* Work that is done by equal items, each costing what it costs, is done in units of about so long: a piece has a
 * few of them. */
#define PIECE_UNIT_NS UINT64_C(4000000)

enum tracer_progress { TRACER_FAILED, TRACER_MORE, TRACER_DONE };

static inline enum tracer_progress tracer_progress_of(bool good)
{
    return good ? TRACER_DONE : TRACER_FAILED;
}

/* By clock_now_ns(). */
static inline bool piece_is_over(uint64_t piece_end_ns)
{
    return piece_end_ns != PIECE_WITHOUT_END && clock_now_ns() >= piece_end_ns;
}

/* How many items the next unit is to have, where the last one's `items` took so long. At most twice as many: the
 * next ones may cost more. */
static inline uint32_t piece_unit_items(uint32_t items, uint64_t took_ns)
{
    const uint64_t fitting = items * PIECE_UNIT_NS / (took_ns + 1), most = 2 * (uint64_t)items;
    const uint64_t next = fitting < most ? fitting : most;
    return next < 1 ? 1 : next < UINT32_MAX / 2 ? (uint32_t)next : UINT32_MAX / 2;
}

#endif
