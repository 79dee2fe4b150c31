/* SPDX-License-Identifier: MIT */
/* Monotonic clock, and waits on it. */
#include "base/clock.h"

#include "protocol/common/clock.h"

#include <errno.h>
#include <time.h>

#define NS_PER_S UINT64_C(1000000000)

uint64_t clock_now_ns(void)
{
    return monotonic_now_ns();
}

bool clock_wait(pthread_cond_t *condition, pthread_mutex_t *lock, uint64_t until_ns)
{
    const struct timespec until = {.tv_sec = (time_t)(until_ns / NS_PER_S),
                                   .tv_nsec = (long)(until_ns % NS_PER_S)};
    if (until_ns == UINT64_MAX)
        return pthread_cond_wait(condition, lock) == 0;
    return pthread_cond_clockwait(condition, lock, CLOCK_MONOTONIC, &until) != ETIMEDOUT;
}

bool clock_wait_for(const bool *flag, pthread_cond_t *condition, pthread_mutex_t *lock, uint64_t until_ns)
{
    bool in_time = true;
    pthread_mutex_lock(lock);
    while (!*flag && in_time)
        in_time = clock_wait(condition, lock, until_ns);
    const bool is_set = *flag;
    pthread_mutex_unlock(lock);
    return is_set;
}
