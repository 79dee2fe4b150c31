/* SPDX-License-Identifier: MIT */
/* Sums of stage times over the engine's life. Any thread may add, any may read. */
#ifndef FARLIGHT_ENGINE_TOTALS_H
#define FARLIGHT_ENGINE_TOTALS_H

#include "base/stage_times.h"

#include <stdatomic.h>

struct stage_total {
    _Atomic uint64_t count, total_ns, max_ns;
};
struct stage_totals {
    struct stage_total by_stage[STAGE_COUNT][2]; /* by stage and clock */
};

void stage_totals_add(struct stage_totals *totals, enum stage stage, enum clock clock, uint64_t duration_ns);
/* Adds every span of a frame. */
void stage_totals_add_times(struct stage_totals *totals, const struct stage_times *times);

#endif
