/* SPDX-License-Identifier: MIT */
/* Event loop: waits for descriptors and timers and calls their owners. Independent of the product. One thread. */
#ifndef FARLIGHT_NET_LOOP_H
#define FARLIGHT_NET_LOOP_H

#include "base/error.h"

#include <stdbool.h>
#include <stdint.h>

struct loop;
struct loop_watch;

typedef void loop_ready_fn(void *context, uint32_t epoll_events);
typedef void loop_call_fn(void *context);

/* A timer in the owner's memory; all-zero does not run. */
struct loop_timer {
    struct loop_timer *previous, *next;
    bool running;
    uint64_t due_ns;
    loop_call_fn *call;
    void *context;
};

/* A deferred call in the owner's memory, which must live until the call. */
struct loop_deferred {
    struct loop_deferred *next;
    bool waiting;
    loop_call_fn *call;
    void *context;
};

struct loop *loop_create(struct error *error);
void loop_destroy(struct loop *loop); /* accepts NULL; all watches must be removed before */

/* Adds a watch. Level-triggered; EPOLLERR and EPOLLHUP are always reported. NULL and *error on failure. */
struct loop_watch *loop_watch_add(struct loop *loop, int fd, uint32_t epoll_events, loop_ready_fn *ready,
                                  void *context, struct error *error);
void loop_watch_change(struct loop_watch *watch, uint32_t epoll_events);
/* Removes a watch, before the descriptor is closed. It is not called any more, even if it is ready right now.
 * Accepts NULL. */
void loop_watch_remove(struct loop_watch *watch);

/* Starts a timer, or restarts it. */
void loop_timer_start(struct loop *loop, struct loop_timer *timer, uint64_t delay_ns);
void loop_timer_stop(struct loop *loop, struct loop_timer *timer);

/* Calls back after the handlers of this turn: the place to release what a handler may still use. A second request
 * while it waits changes nothing; a request during the call means one more call, in the next turn. */
void loop_defer(struct loop *loop, struct loop_deferred *deferred);

bool loop_run(struct loop *loop, struct error *error); /* until loop_stop() */
/* Runs one turn: waits until a descriptor is ready or a timer due, and calls its owner. */
bool loop_turn(struct loop *loop, struct error *error);
void loop_stop(struct loop *loop);
void loop_run_deferred(struct loop *loop); /* runs the calls at once, for an orderly end outside loop_run() */

#endif
