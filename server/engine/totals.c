/* SPDX-License-Identifier: MIT */
#include "engine/totals.h"

void stage_totals_add(struct stage_totals *totals, enum stage stage, enum clock clock, uint64_t duration_ns)
{
    /* Only sums: no reader draws conclusions from one about another, so the order does not matter. */
    struct stage_total *total = &totals->by_stage[stage][clock];
    atomic_fetch_add_explicit(&total->count, 1, memory_order_relaxed);
    atomic_fetch_add_explicit(&total->total_ns, duration_ns, memory_order_relaxed);
    uint64_t maximum = atomic_load_explicit(&total->max_ns, memory_order_relaxed);
    while (duration_ns > maximum &&
           !atomic_compare_exchange_weak_explicit(&total->max_ns, &maximum, duration_ns, memory_order_relaxed,
                                                  memory_order_relaxed)) {
    }
}

void stage_totals_add_times(struct stage_totals *totals, const struct stage_times *times)
{
    for (uint32_t i = 0; i < times->count; i++)
        stage_totals_add(totals, times->spans[i].stage, times->spans[i].clock, times->spans[i].duration_ns);
}
