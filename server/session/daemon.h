/* SPDX-License-Identifier: MIT */
/* The process that serves: one client, which has started it, or those that a front hands over. Runs on the thread
 * that calls it. */
#ifndef FARLIGHT_SESSION_DAEMON_H
#define FARLIGHT_SESSION_DAEMON_H

#include "net/channel.h"
#include "session/hub.h"

#include <stdbool.h>

struct daemon {
    struct loop *loop;
    struct hub hub;
    struct channel front; /* closed: it serves one client alone */
    uint32_t handed;      /* clients that came from there */
    int signal_fd;
    struct loop_watch *signal_watch;
    struct loop_timer stop_timer;
    struct loop_timer unused_timer; /* runs from the last client's end */
    uint32_t unused_s;              /* without a client, after which the front is told so */
    bool device_gone;               /* the engine's is lost for good: that is why it ends */
    struct loop_timer watchdog_timer;
    uint64_t watchdog_ns;  /* without progress, after which the front is told that the device hangs; 0: never */
    uint64_t engine_turns; /* for engine_is_alive() */
    uint64_t alive_ns;
    /* From the front came another configuration, and whose process this is. */
    void (*configured)(void *context, const void *setup, size_t bytes);
    void (*owned)(void *context, const struct channel_owner *owner);
    void *front_context;
    int32_t device; /* index of the engine's, for the front */
};

/* Blocks SIGTERM and SIGINT in the calling thread, for the loop to handle; call it before any thread starts, so
 * that all inherit the mask. SIGPIPE and SIGHUP are ignored. */
void daemon_block_signals(void);
/* Zeroes it. */
void daemon_init(struct daemon *daemon);
/* Makes loop and hub. On failure daemon_finish() takes down what was begun. */
bool daemon_start(struct daemon *daemon, const struct hub_options *options, struct error *error);
/* The client at this connected socket is served, and the daemon ends with it. Takes over the descriptor when it
 * succeeds. */
bool daemon_serve_fd(struct daemon *daemon, int fd, struct error *error);
/* Clients come from the front at that end of a channel, which is told that they can be served; the daemon ends
 * with it. `owner`: whose process it is, NULL: nobody's yet. Takes over the descriptor when it succeeds. */
bool daemon_serve_front(struct daemon *daemon, int fd, const struct channel_owner *owner, struct error *error);
/* Until SIGTERM or SIGINT, after a goodbye to the clients. *device_gone: it ended because its GPU is lost for
 * good. */
bool daemon_run(struct daemon *daemon, bool *device_gone, struct error *error);
void daemon_finish(struct daemon *daemon);

#endif
