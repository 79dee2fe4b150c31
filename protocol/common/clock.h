/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_PROTOCOL_COMMON_CLOCK_H
#define FARLIGHT_PROTOCOL_COMMON_CLOCK_H

#include <stdint.h>
#include <time.h>

/* Comparable between threads and processes of a machine until it is started again. */
static inline uint64_t monotonic_now_ns(void)
{
    struct timespec now = {0};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

#endif
