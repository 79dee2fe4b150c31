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

#endif
