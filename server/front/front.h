/* SPDX-License-Identifier: MIT */
/* The daemon that people start: it listens, learns who comes, reads each client's hello, and hands the client to
 * the worker of its user, a process that is started when it is needed. No GL, no scene, no message but the hello.
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
    uint32_t clients;                     /* that all workers serve */
    uint32_t clients_of_one;              /* that one of them serves */
    uint32_t unauthenticated;             /* connections whose hello has not come */
    uint32_t unauthenticated_per_address; /* from one TCP peer */
    uint32_t handshakes_a_second;         /* sealed ones, from one network; further ones wait */
};

struct front_options {
    struct front_limits limits;
    struct connection_limits connection_limits;
    struct readers readers; /* of the Unix socket */
    struct shares shares;   /* of processor time; of workers that start from then on */
    struct auth_keys *keys; /* with which clients come in sealed, from everywhere; the front takes a reference */
    bool insecure;          /* peers beyond loopback are accepted without a key too */
    int owner_fd;           /* of the client with which the daemon ends, to be taken over; < 0: there is none */
    uint64_t unused_ns;     /* without a client, after which the daemon ends; 0: it does not */
    const uint64_t *owners; /* who has kept scenes: their workers start with the front */
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
    struct loop_timer accept_timer;   /* after which listeners are looked at again */
    struct loop_timer extend_timer;   /* after which the service manager is told that the start goes on */
    struct loop_timer stop_timer;     /* after which workers that are left are killed */
    struct loop_timer ping_timer;     /* after which workers are asked for a sign */
    struct loop_timer watchdog_timer; /* after which the service manager is told that all goes on */
    uint64_t watchdog_ns;             /* it wants to hear that so often; 0: it does not */
    struct loop_timer unused_timer;   /* runs from the last client's end */
    bool stopping;
    bool reloading; /* workers have not all taken what was read again */

    struct caller *callers; /* whom no worker has yet */
    struct hashmap sources; /* struct source *, by owner: how many of its callers have said nothing */
    size_t unauthenticated;
    struct attempts attempts; /* sealed handshakes */

    struct worker *workers;
    uint32_t workers_started;
    struct share_groups groups;
    bool ready;           /* a worker was: the device can be used */
    struct error failure; /* why the first worker could not start */

    /* Reads the configuration again and hands it to front_reload(), at SIGHUP. */
    loop_call_fn *reload;
    void *reload_context;
};

/* Zeroes it. */
void front_init(struct front *front);
/* Reserves addresses, separated by blanks (at least one; their paths may have blanks); clients wait until
 * front_run(). */
bool front_listen(struct front *front, const char *addresses, bool beyond_loopback, struct error *error);
/* The same with the sockets that the service manager has handed over; *count: how many these were, 0 if we were
 * started otherwise. */
bool front_listen_activated(struct front *front, bool beyond_loopback, size_t *count, struct error *error);
/* Starts the first workers, says READY with the addresses on the stream once they are, and serves until SIGTERM or
 * SIGINT. False and *error: it cannot start, or cannot go on. */
bool front_run(struct front *front, const struct front_options *options, FILE *stream, struct error *error);
void front_finish(struct front *front);
/* Applies limits, readers and keys to new clients, and hands the setup to all workers. False: out of memory,
 * nothing is changed. */
bool front_reload(struct front *front, const struct front_options *options, struct error *error);

/* ---- for the files of this folder ---- */
void front_stop(struct front *front);
/* A worker has taken its configuration, or is gone. */
void front_configured(struct front *front);
/* A worker has other clients than before. */
void front_counted(struct front *front);
/* A worker can be used, or has ended; `failure` says why. */
void front_settled(struct front *front, const struct error *failure);

#endif
