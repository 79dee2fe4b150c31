/* SPDX-License-Identifier: MIT */
/* Threads that share a loop. Free threads take items in order; the caller works too. */
#ifndef FARLIGHT_CLIENT_WARP_POOL_H
#define FARLIGHT_CLIENT_WARP_POOL_H

#include <stdbool.h>
#include <stdint.h>

struct warp_pool;

/* `worker` is below the number of threads, and differs between simultaneous calls. */
typedef void warp_pool_work(void *context, unsigned item, unsigned worker);

/* `threads` includes the caller. NULL: no memory, or a thread cannot be started. */
struct warp_pool *warp_pool_create(unsigned threads);
void warp_pool_destroy(struct warp_pool *pool);
unsigned warp_pool_threads(const struct warp_pool *pool);
/* Returns when all items are done, with the processor time of all threads, ns. */
uint64_t warp_pool_run(struct warp_pool *pool, warp_pool_work *work, void *context, unsigned items);

#endif
