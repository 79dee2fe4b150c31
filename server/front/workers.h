/* SPDX-License-Identifier: MIT */
/* The processes that serve: one for each user, each key, and each network of unidentified clients. */
#ifndef FARLIGHT_FRONT_WORKERS_H
#define FARLIGHT_FRONT_WORKERS_H

#include "front/front.h"
#include "net/channel.h"

#include <sys/types.h>

struct worker {
    struct front *front;
    struct worker *next;
    uint32_t number;
    bool has_owner;
    struct channel_owner owner;
    int32_t device; /* its index; -1: not known yet */
    pid_t pid;
    int pid_fd;
    struct loop_watch *pid_watch;
    struct channel channel;
    bool is_ready, is_stopping;
    bool was_ready;        /* whether its device could be used */
    bool has_daemon_owner; /* whether it serves the client with which the daemon ends */
    uint32_t handed;
    uint32_t pings_due;   /* pings without an answer */
    uint32_t configs_due; /* configurations after its first that it has not acknowledged */
    struct channel_counts counts;
    struct error failure; /* why it ends, in its own words */
};

/* Starts a process of that owner; NULL: one without an owner yet. NULL and *error: it cannot be started. */
struct worker *workers_start(struct front *front, const struct channel_owner *owner, struct error *error);
/* Starts the process that waits for the next user: without an owner, or the daemon's own user's where workers must
 * know their owner from the start. */
struct worker *workers_start_ahead(struct front *front, struct error *error);
/* Worker of the owner, started if there is none. */
struct worker *workers_of(struct front *front, uint64_t owner, const char *name, struct error *error);
uint32_t workers_clients(const struct front *front);
uint32_t workers_clients_of(const struct front *front, uint64_t owner);
void workers_stop(struct front *front); /* asks the workers to end */
void workers_kill(struct front *front);
/* Pings each ready worker, and kills those that have not answered several times. */
void workers_ping(struct front *front);
void workers_send_setup(struct front *front);
bool workers_have_setup(const struct front *front); /* whether every worker has acknowledged the setup */
void workers_finish(struct front *front);           /* kills the workers that are left */

#endif
