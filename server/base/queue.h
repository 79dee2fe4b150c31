/* SPDX-License-Identifier: MIT */
/* Bounded queue of pointers between threads. Any thread may push or pop. */
#ifndef FARLIGHT_BASE_QUEUE_H
#define FARLIGHT_BASE_QUEUE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct queue;

/* Creates a queue. `event_fd`: with an eventfd that is readable while the queue is not empty, for an epoll
 * loop. NULL when out of memory or descriptors. */
struct queue *queue_create(size_t capacity, bool event_fd);
/* Destroys a queue; drops its items through `drop` (may be NULL). Accepts NULL. No thread may still wait on it. */
void queue_destroy(struct queue *queue, void (*drop)(void *item));

bool queue_try_push(struct queue *queue, void *item); /* false: full or closed */
bool queue_push(struct queue *queue, void *item);     /* waits while full; false: closed */
void *queue_try_pop(struct queue *queue);             /* NULL: empty */
void *queue_pop(struct queue *queue,
                uint64_t timeout_ns);  /* waits; NULL: timed out, or closed and empty. UINT64_MAX: for ever */
void queue_close(struct queue *queue); /* no more pushes; wakes everybody */
size_t queue_length(struct queue *queue);
int queue_event_fd(const struct queue *queue); /* -1 if made without */

#endif
