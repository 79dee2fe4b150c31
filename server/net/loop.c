/* SPDX-License-Identifier: MIT */
/* Event loop over epoll, with timers and deferred calls. */
#include "net/loop.h"

#include "base/clock.h"
#include "base/sys.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define EVENTS_A_TURN 64

struct loop_watch {
    struct loop *loop;
    int fd;
    uint32_t epoll_events;
    bool removed;
    loop_ready_fn *ready;
    void *context;
    struct loop_watch *next_removed;
};

struct loop {
    int epoll_fd;
    bool stopped;
    struct loop_timer *timers; /* unsorted: there is one per connection, and few connections */
    struct loop_deferred *deferred;
    struct loop_watch *removed; /* freed once no event of this turn can refer to them */
};

struct loop *loop_create(struct error *error)
{
    struct loop *loop = calloc(1, sizeof(*loop));
    if (!loop) {
        error_set(error, ERROR_OUT_OF_MEMORY, "loop", "no memory");
        return NULL;
    }
    loop->epoll_fd = epoll_create1(EPOLL_CLOEXEC);
    if (loop->epoll_fd < 0) {
        error_set(error, ERROR_INTERNAL, "loop", "epoll_create1: %s", strerror(errno));
        free(loop);
        return NULL;
    }
    return loop;
}

static void free_removed(struct loop *loop)
{
    while (loop->removed) {
        struct loop_watch *watch = loop->removed;
        loop->removed = watch->next_removed;
        free(watch);
    }
}

/* Runs deferred calls. Work that these defer belongs to the next turn, so that descriptors and timers are
 * served in between. */
static void run_deferred(struct loop *loop)
{
    struct loop_deferred *waiting = loop->deferred;
    loop->deferred = NULL;
    while (waiting) {
        struct loop_deferred *deferred = waiting;
        waiting = deferred->next;
        deferred->waiting = false;
        deferred->call(deferred->context);
    }
}

void loop_run_deferred(struct loop *loop)
{
    while (loop->deferred)
        run_deferred(loop);
}

void loop_destroy(struct loop *loop)
{
    if (!loop)
        return;
    loop_run_deferred(loop);
    free_removed(loop);
    close(loop->epoll_fd);
    free(loop);
}

struct loop_watch *loop_watch_add(struct loop *loop, int fd, uint32_t epoll_events, loop_ready_fn *ready,
                                  void *context, struct error *error)
{
    struct loop_watch *watch = calloc(1, sizeof(*watch));
    if (!watch) {
        error_set(error, ERROR_OUT_OF_MEMORY, "loop", "no memory");
        return NULL;
    }
    *watch = (struct loop_watch){
        .loop = loop, .fd = fd, .epoll_events = epoll_events, .ready = ready, .context = context};
    struct epoll_event event = {.events = epoll_events, .data.ptr = watch};
    if (epoll_ctl(loop->epoll_fd, EPOLL_CTL_ADD, fd, &event) < 0) {
        error_set(error, ERROR_INTERNAL, "loop", "cannot watch descriptor %d: %s", fd, strerror(errno));
        free(watch);
        return NULL;
    }
    return watch;
}

void loop_watch_change(struct loop_watch *watch, uint32_t epoll_events)
{
    if (watch->epoll_events == epoll_events)
        return;
    watch->epoll_events = epoll_events;
    struct epoll_event event = {.events = epoll_events, .data.ptr = watch};
    /* The call cannot fail for a descriptor that was added and is open. */
    epoll_ctl(watch->loop->epoll_fd, EPOLL_CTL_MOD, watch->fd, &event);
}

void loop_watch_remove(struct loop_watch *watch)
{
    if (!watch || watch->removed)
        return;
    epoll_ctl(watch->loop->epoll_fd, EPOLL_CTL_DEL, watch->fd, NULL);
    watch->removed = true;
    watch->next_removed = watch->loop->removed;
    watch->loop->removed = watch;
}

void loop_timer_stop(struct loop *loop, struct loop_timer *timer)
{
    if (!timer->running)
        return;
    timer->running = false;
    if (timer->previous)
        timer->previous->next = timer->next;
    else
        loop->timers = timer->next;
    if (timer->next)
        timer->next->previous = timer->previous;
}

void loop_timer_start(struct loop *loop, struct loop_timer *timer, uint64_t delay_ns)
{
    timer->due_ns = clock_now_ns() + delay_ns;
    if (timer->running)
        return;
    timer->running = true;
    timer->previous = NULL;
    timer->next = loop->timers;
    if (loop->timers)
        loop->timers->previous = timer;
    loop->timers = timer;
}

void loop_defer(struct loop *loop, struct loop_deferred *deferred)
{
    if (deferred->waiting)
        return;
    deferred->waiting = true;
    deferred->next = loop->deferred;
    loop->deferred = deferred;
}

static struct loop_timer *first_due(const struct loop *loop)
{
    struct loop_timer *first = loop->timers;
    for (struct loop_timer *timer = first; timer; timer = timer->next) {
        if (timer->due_ns < first->due_ns)
            first = timer;
    }
    return first;
}

/* Runs timers. A call may start and stop any timer, so the list is searched again after each; a timer that a
 * call starts is due in the next turn at the earliest. */
static void run_timers(struct loop *loop)
{
    uint64_t now_ns = clock_now_ns();
    struct loop_timer *timer;
    while ((timer = first_due(loop)) && timer->due_ns <= now_ns) {
        loop_timer_stop(loop, timer);
        timer->call(timer->context);
    }
}

static int timeout_ms(const struct loop *loop)
{
    if (loop->deferred)
        return 0;
    struct loop_timer *timer = first_due(loop);
    if (!timer)
        return -1;
    uint64_t now_ns = clock_now_ns();
    if (timer->due_ns <= now_ns)
        return 0;
    uint64_t wait_ms = (timer->due_ns - now_ns + 999999) / 1000000; /* rounded up: never a turn too early */
    return wait_ms > 60000 ? 60000 : (int)wait_ms;
}

bool loop_turn(struct loop *loop, struct error *error)
{
    struct epoll_event events[EVENTS_A_TURN];
    int count = sys.epoll_wait(loop->epoll_fd, events, EVENTS_A_TURN, timeout_ms(loop));
    /* A process that was stopped continues here: messages that came meanwhile are read before timers are due. */
    if (count < 0)
        return errno == EINTR || error_set(error, ERROR_INTERNAL, "loop", "epoll_wait: %s", strerror(errno));
    for (int i = 0; i < count; i++) {
        struct loop_watch *watch = events[i].data.ptr;
        if (!watch->removed)
            watch->ready(watch->context, events[i].events);
    }
    run_deferred(loop);
    free_removed(loop);
    run_timers(loop);
    return true;
}

bool loop_run(struct loop *loop, struct error *error)
{
    while (!loop->stopped) {
        if (!loop_turn(loop, error))
            return false;
    }
    loop->stopped = false; /* allows another run */
    return true;
}

void loop_stop(struct loop *loop)
{
    loop->stopped = true;
}
