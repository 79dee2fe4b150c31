/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_BASE_CLOCK_H
#define FARLIGHT_BASE_CLOCK_H

#include <stdint.h>

/* Monotonic time in nanoseconds; comparable between threads of this process. */
uint64_t clock_now_ns(void);

#endif
