/* SPDX-License-Identifier: MIT */
/* Monotonic clock, and waits that end by it. */
#ifndef FARLIGHT_BASE_CLOCK_H
#define FARLIGHT_BASE_CLOCK_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

/* Monotonic time in nanoseconds; comparable between threads of this process. */
uint64_t clock_now_ns(void);
/* Waits as pthread_cond_wait() does, at most until that time of the clock; UINT64_MAX: no limit. False: the
 * time is over. */
bool clock_wait(pthread_cond_t *condition, pthread_mutex_t *lock, uint64_t until_ns);
/* Takes the lock, waits until *flag, which it guards, is set, or until that time; returns *flag. */
bool clock_wait_for(const bool *flag, pthread_cond_t *condition, pthread_mutex_t *lock, uint64_t until_ns);

#endif
