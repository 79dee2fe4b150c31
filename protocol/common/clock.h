/* SPDX-License-Identifier: MIT */
/* The monotonic clock. */
#ifndef FARLIGHT_PROTOCOL_COMMON_CLOCK_H
#define FARLIGHT_PROTOCOL_COMMON_CLOCK_H

#include <stdint.h>
#include <time.h>

/* Nanoseconds since the machine started; comparable between its threads and processes. */
static inline uint64_t monotonic_now_ns(void)
{
    struct timespec now = {0};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

#endif
