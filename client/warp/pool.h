/* SPDX-License-Identifier: MIT */
/* A few threads that share a loop. Items are taken in their order, by whoever is free; the caller works too. */
#ifndef FARLIGHT_CLIENT_WARP_POOL_H
#define FARLIGHT_CLIENT_WARP_POOL_H

#include <stdbool.h>
#include <stdint.h>

struct warp_pool;

/* `worker` is below the number of threads, and no two calls at a time have the same. */
typedef void warp_pool_work(void *context, unsigned item, unsigned worker);

/* `threads` counts the caller's. NULL: no memory, or a thread cannot be started. */
struct warp_pool *warp_pool_create(unsigned threads);
void warp_pool_destroy(struct warp_pool *pool);
unsigned warp_pool_threads(const struct warp_pool *pool);
/* Until all items are done. Returns the processor time of all threads, ns. */
uint64_t warp_pool_run(struct warp_pool *pool, warp_pool_work *work, void *context, unsigned items);

#endif
