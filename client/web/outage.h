/* SPDX-License-Identifier: MIT */
/* Outages of the daemon, reported to the operator once, although each browser notices them and tries again. */
#ifndef FARLIGHT_CLIENT_WEB_OUTAGE_H
#define FARLIGHT_CLIENT_WEB_OUTAGE_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

/* Minimum time between reports of outages: a daemon that fails repeatedly, or only for some browsers, must not
 * flood the log. */
#define OUTAGE_PAUSE_NS 10000000000ull

struct web_outage {
    pthread_mutex_t lock; /* shared by all seats' threads; guards the members below */
    bool is_reported;
    uint64_t reported_ns; /* time of the last report; 0: none */
};

void web_outage_init(struct web_outage *outage);
/* A seat has lost the daemon, or cannot reach it. True: the caller reports it. */
bool web_outage_begins(struct web_outage *outage, uint64_t now_ns);
/* A seat has reached the daemon. True: the outage was reported, and the caller reports its end. */
bool web_outage_ends(struct web_outage *outage);

#endif
