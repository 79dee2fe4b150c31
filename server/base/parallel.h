/* SPDX-License-Identifier: MIT */
/* Loops over independent items on several threads, for one-off work of milliseconds and more. */
#ifndef FARLIGHT_BASE_PARALLEL_H
#define FARLIGHT_BASE_PARALLEL_H

#include <stdint.h>

/* Calls work(context, i) for i in 0 .. count - 1 from up to `threads` threads (at most 64), including the
 * caller's, and returns when all calls have. With one thread, or if none can be started, the caller makes all
 * calls. */
void parallel_run(unsigned threads, uint32_t count, void (*work)(void *context, uint32_t i), void *context);
/* The number of processors that this process may use, at least 1. */
unsigned parallel_processors(void);

#endif
