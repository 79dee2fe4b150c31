/* SPDX-License-Identifier: MIT */
#include "base/clock.h"

#include "protocol/common/clock.h"

uint64_t clock_now_ns(void)
{
    return monotonic_now_ns();
}
