/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_BASE_CLOCK_H
#define FARLIGHT_BASE_CLOCK_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

/* Monotonic time in nanoseconds; comparable between threads of this process. */
uint64_t clock_now_ns(void);
/* pthread_cond_wait() until that time of the clock; UINT64_MAX: without a limit. False: the time is over. */
bool clock_wait(pthread_cond_t *condition, pthread_mutex_t *lock, uint64_t until_ns);
/* Takes the lock, waits until *flag is set, which it guards, or until that time; returns *flag. */
bool clock_wait_for(const bool *flag, pthread_cond_t *condition, pthread_mutex_t *lock, uint64_t until_ns);

#endif
