/* SPDX-License-Identifier: MIT */
/* Where a frame's time goes. Every stage of the way of the data reports here. */
#ifndef FARLIGHT_BASE_STAGE_TIMES_H
#define FARLIGHT_BASE_STAGE_TIMES_H

#include "base/words.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct stage_span {
    enum stage stage;
    enum clock clock;
    /* Of trace and shade: number of the wave in its frame. Of a build by `ldc`: which cube, 0 the static one, 1
     * the dynamic one; on the GPU's clock these are all that there are of a build. */
    uint32_t wave;
    uint64_t start_ns; /* since `origin_ns` */
    uint64_t duration_ns;
};

/* 512 spans reach the wire; spans beyond are added to the last of the same stage and clock. */
#define STAGE_SPANS_MAX 512

struct stage_times {
    uint64_t origin_ns; /* clock_now_ns() at the frame's start */
    uint32_t count;
    struct stage_span spans[STAGE_SPANS_MAX];
};

void stage_times_begin(struct stage_times *times); /* empties it, sets the origin to now */
/* `start_ns` by clock_now_ns(). `times` may be NULL: nothing happens. */
void stage_times_add(struct stage_times *times, enum stage stage, enum clock clock, uint32_t wave,
                     uint64_t start_ns, uint64_t duration_ns);
uint64_t stage_times_sum_ns(const struct stage_times *times, enum stage stage, enum clock clock);
const char *stage_name(enum stage stage);

#endif
