/* SPDX-License-Identifier: MIT */
/* Counts wrong keys by network: after `limit` of them within a minute, further attempts from that network are
 * refused for a while. Pure: the caller passes the time. One thread. */
#ifndef FARLIGHT_NET_ATTEMPTS_H
#define FARLIGHT_NET_ATTEMPTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define ATTEMPTS_LIMIT_MAX 16
/* With more networks than this, the one whose last wrong key is oldest is forgotten. */
#define ATTEMPTS_NETWORKS 256

struct attempts {
    struct attempts_network {
        uint64_t network;                       /* see address_network() */
        uint64_t failed_ns[ATTEMPTS_LIMIT_MAX]; /* a ring; 0: none */
        size_t next;
    } networks[ATTEMPTS_NETWORKS]; /* all zero: no failures */
};

void attempts_add_failed(struct attempts *attempts, uint64_t network, uint64_t now_ns);
/* Whether fewer than `limit` (at most ATTEMPTS_LIMIT_MAX) attempts failed within the last minute. */
bool attempts_are_allowed(const struct attempts *attempts, uint64_t network, uint32_t limit, uint64_t now_ns);

#endif
