/* SPDX-License-Identifier: MIT */
/* The network side as a whole: listeners, signals, sessions. Runs on the thread that calls it. */
#ifndef FARLIGHT_SESSION_DAEMON_H
#define FARLIGHT_SESSION_DAEMON_H

#include "net/listen.h"
#include "session/hub.h"

#include <signal.h>
#include <stdbool.h>
#include <stdio.h>

#define DAEMON_LISTENERS_MAX 16

struct daemon {
    struct loop *loop;
    struct hub hub;
    struct listener listeners[DAEMON_LISTENERS_MAX];
    struct loop_watch *listener_watches[DAEMON_LISTENERS_MAX];
    size_t listener_count;
    int signal_fd;
    struct loop_watch *signal_watch;
    struct loop_timer accept_timer, stop_timer; /* after which listeners are looked at again */
    struct loop_timer watchdog_timer;           /* after which the service manager is told that all goes on */
    uint64_t watchdog_ns;                       /* it wants to hear that so often; 0: it does not */
    uint64_t engine_turns;                      /* for engine_is_alive() */
    struct loop_timer unused_timer;             /* runs from the last client's end */
    uint64_t unused_ns;                         /* without a client, after which it ends; 0: it does not */
    bool device_gone;                           /* the engine's is lost for good: that is why it ends */
    /* Reads the configuration again and hands it to hub_reload(), at SIGHUP; NULL: that changes nothing. */
    loop_call_fn *reload;
    void *reload_context;
};

/* Blocks SIGTERM, SIGINT and SIGHUP in the calling thread, for the loop to handle; call it before any thread
 * starts, so that all inherit the mask. SIGPIPE is ignored. */
void daemon_block_signals(void);
/* Zeroes it. */
void daemon_init(struct daemon *daemon);
/* Reserves addresses, separated by blanks (at least one; their paths may have blanks); clients wait until
 * daemon_start(). */
bool daemon_listen(struct daemon *daemon, const char *addresses, bool beyond_loopback, struct error *error);
/* The same with the sockets that the service manager has handed over; *count: how many these were, 0 if we were
 * started otherwise. */
bool daemon_listen_activated(struct daemon *daemon, bool beyond_loopback, size_t *count, struct error *error);
bool daemon_start(struct daemon *daemon, const struct hub_options *options, struct error *error);
/* Serves the client at a connected socket, and ends with it. It may listen besides. */
bool daemon_serve_fd(struct daemon *daemon, int fd, struct error *error);
/* "READY ADDRESS", one line an address, with the port that was chosen; "READY" alone where it listens nowhere. */
void daemon_print_ready(const struct daemon *daemon, FILE *stream);
/* Until SIGTERM or SIGINT comes, the device is lost for good (then *device_gone is true), or the client of
 * daemon_serve_fd() is gone. Says goodbye to all. */
bool daemon_run(struct daemon *daemon, bool *device_gone, struct error *error);
void daemon_finish(struct daemon *daemon); /* whatever was begun; before the engine is destroyed */

#endif
