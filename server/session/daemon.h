/* SPDX-License-Identifier: MIT */
/* The process that serves: either the one client that has started it, or the clients that a front hands over. Runs
 * on the thread that calls it. */
#ifndef FARLIGHT_SESSION_DAEMON_H
#define FARLIGHT_SESSION_DAEMON_H

#include "net/channel.h"
#include "session/hub.h"

#include <stdbool.h>

struct daemon {
    struct loop *loop;
    struct hub hub;
    struct channel front; /* closed: the daemon serves one client alone */
    uint32_t handed;      /* clients that came from the front */
    int signal_fd;
    struct loop_watch *signal_watch;
    struct loop_timer stop_timer;
    struct loop_timer unused_timer; /* runs from the last client's end */
    uint32_t unused_s;              /* time without a client after which the front is notified */
    bool device_gone;               /* whether it ends because the engine's device is lost for good */
    struct loop_timer watchdog_timer;
    /* Time without progress after which the front is notified that the device hangs; 0: never. */
    uint64_t watchdog_ns;
    uint64_t engine_turns; /* for engine_is_alive() */
    uint64_t alive_ns;
    /* The front has sent a new configuration; the front has set the process's owner. */
    void (*configured)(void *context, const void *setup, size_t bytes);
    void (*owned)(void *context, const struct channel_owner *owner);
    void *front_context;
    int32_t device; /* index of the engine's device, for the front */
};

/* Blocks SIGTERM and SIGINT in the calling thread, for the loop to handle; call it before any thread starts, so
 * that all inherit the mask. SIGPIPE and SIGHUP are ignored. */
void daemon_block_signals(void);
/* Zeroes it. */
void daemon_init(struct daemon *daemon);
/* Makes loop and hub. After a failure daemon_finish() releases whatever was made. */
bool daemon_start(struct daemon *daemon, const struct hub_options *options, struct error *error);
/* Serves the client at this connected socket; the daemon ends with it. Takes over the descriptor when it succeeds.
 */
bool daemon_serve_fd(struct daemon *daemon, int fd, struct error *error);
/* Serves clients from the front at the other end of a channel, and ends with it; the front is notified that it can
 * send them. `owner`: the owner of the process; NULL: none yet. Takes over the descriptor when it succeeds. */
bool daemon_serve_front(struct daemon *daemon, int fd, const struct channel_owner *owner, struct error *error);
/* Runs until SIGTERM or SIGINT, and says goodbye to the clients. *device_gone: it ended because its GPU is lost
 * for good. */
bool daemon_run(struct daemon *daemon, bool *device_gone, struct error *error);
void daemon_finish(struct daemon *daemon);

#endif
