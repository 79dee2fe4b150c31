/* SPDX-License-Identifier: MIT */
/* What the operator is told of a daemon that is away: each browser notices and tries again, and the operator is
 * told once. */
#ifndef FARLIGHT_CLIENT_WEB_OUTAGE_H
#define FARLIGHT_CLIENT_WEB_OUTAGE_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

/* Between the begins that are told: a daemon that fails again and again, or only some browsers, is no flood of
 * lines. */
#define OUTAGE_PAUSE_NS 10000000000ull

struct web_outage {
    pthread_mutex_t lock; /* of all seats' threads; guards what follows */
    bool is_told;
    uint64_t told_ns; /* the last one; 0: none was */
};

void web_outage_init(struct web_outage *outage);
/* A seat has lost the daemon, or does not reach it. True: this is to be told. */
bool web_outage_begins(struct web_outage *outage, uint64_t now_ns);
/* A seat has reached it. True: its begin was told, and so is this to be. */
bool web_outage_ends(struct web_outage *outage);

#endif
