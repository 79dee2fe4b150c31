/* SPDX-License-Identifier: MIT */
/* The daemon that people start: it listens, identifies each client, reads its hello, and hands it to the worker of
 * its user, a process that is started on demand. It has no GL and no scene, and reads no message but the hello.
 * Runs on the thread that calls it. */
#ifndef FARLIGHT_FRONT_FRONT_H
#define FARLIGHT_FRONT_FRONT_H

#include "base/hashmap.h"
#include "front/shares.h"
#include "net/attempts.h"
#include "net/auth.h"
#include "net/connection.h"
#include "net/listen.h"
#include "net/loop.h"
#include "net/readers.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#define FRONT_LISTENERS_MAX 16

struct front_limits {
    uint32_t clients;                     /* maximum of clients of all workers together */
    uint32_t clients_of_one;              /* maximum of clients of one worker */
    uint32_t unauthenticated;             /* connections whose hello has not come */
    uint32_t unauthenticated_per_address; /* from one TCP peer */
    uint32_t handshakes_a_second;         /* sealed ones, from one network; further ones wait */
};

struct front_options {
    struct front_limits limits;
    struct connection_limits connection_limits;
    struct readers readers; /* users of the Unix socket who may only view */
    struct shares shares;   /* shares of processor time, for workers that start from then on */
    /* Keys with which clients connect sealed, from anywhere; the front takes a reference. */
    struct auth_keys *keys;
    bool insecure;      /* peers beyond loopback are accepted without a key too */
    int owner_fd;       /* socket of the client with which the daemon ends; the front takes it over; < 0: none */
    uint64_t unused_ns; /* time without a client after which the daemon ends; 0: never */
    const uint64_t *owners; /* owners of kept scenes: their workers start with the front */
    size_t owner_count;
    bool owners_first; /* a worker must know its owner from the start: its sandbox lets it reach that owner's files
                        */
    const void *setup; /* first packet of every worker; copied */
    size_t setup_bytes;
};

struct front {
    struct front_options options;
    void *setup;
    struct loop *loop;
    struct listener listeners[FRONT_LISTENERS_MAX];
    struct loop_watch *listener_watches[FRONT_LISTENERS_MAX];
    size_t listener_count;
    int signal_fd;
    struct loop_watch *signal_watch;
    struct loop_timer accept_timer;   /* resumes the listeners */
    struct loop_timer extend_timer;   /* notifies the service manager that the start continues */
    struct loop_timer stop_timer;     /* kills the workers that are left */
    struct loop_timer ping_timer;     /* pings the workers */
    struct loop_timer watchdog_timer; /* notifies the service manager that the front is alive */
    uint64_t watchdog_ns;             /* interval of these notices; 0: none */
    struct loop_timer unused_timer;   /* runs from the last client's end */
    bool stopping;
    bool reloading; /* whether workers have not yet acknowledged the new configuration */

    struct caller *callers; /* callers that no worker has yet */
    struct hashmap sources; /* struct source *, by owner: number of its callers without a hello */
    size_t unauthenticated;
    struct attempts attempts; /* sealed handshakes */

    struct worker *workers;
    uint32_t workers_started;
    struct share_groups groups;
    FILE *ready_stream;   /* where READY is said */
    bool ready;           /* whether a worker was ready: the device can be used */
    struct error failure; /* why the first worker could not start */

    /* Reads the configuration again and hands it to front_reload(), at SIGHUP. */
    loop_call_fn *reload;
    void *reload_context;
};

/* Makes a front without addresses and without a loop. */
void front_init(struct front *front);
/* Reserves addresses, separated by blanks (at least one; their paths may have blanks); clients wait until
 * front_run(). */
bool front_listen(struct front *front, const char *addresses, bool beyond_loopback, struct error *error);
/* Listens at the sockets that the service manager has handed over; *count: their number, 0 if the front was
 * started otherwise. */
bool front_listen_activated(struct front *front, bool beyond_loopback, size_t *count, struct error *error);
/* Starts the first workers, says READY with the addresses on the stream once they are, and serves until SIGTERM or
 * SIGINT. False and *error: it cannot start, or its loop failed. */
bool front_run(struct front *front, const struct front_options *options, FILE *stream, struct error *error);
void front_finish(struct front *front);
/* Applies limits, readers and keys to new clients, and hands the setup to all workers. False: out of memory,
 * nothing is changed. */
bool front_reload(struct front *front, const struct front_options *options, struct error *error);

/* ---- for the files of this folder ---- */
void front_stop(struct front *front);
/* Called when a worker has acknowledged its configuration, or has ended. */
void front_configured(struct front *front);
/* Called when a worker's clients have changed. */
void front_counted(struct front *front);
/* Called when a worker is ready, or has ended; `failure` says why. */
void front_settled(struct front *front, const struct error *failure);

#endif
