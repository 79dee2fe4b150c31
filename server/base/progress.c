/* SPDX-License-Identifier: MIT */
/* Counter of progress. */
#include "base/progress.h"

#include <stdatomic.h>

static atomic_uint_fast64_t told;

void progress_report(void)
{
    atomic_fetch_add_explicit(&told, 1, memory_order_relaxed);
}

uint64_t progress_reports(void)
{
    return atomic_load_explicit(&told, memory_order_relaxed);
}
