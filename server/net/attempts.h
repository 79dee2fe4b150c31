/* SPDX-License-Identifier: MIT */
/* Wrong keys by where they came from: after so many in a minute nobody from there is heard for a while. No clock
 * in here. One thread. */
#ifndef FARLIGHT_NET_ATTEMPTS_H
#define FARLIGHT_NET_ATTEMPTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define ATTEMPTS_LIMIT_MAX 16
/* Of more networks the one whose last wrong key is the longest ago is forgotten. */
#define ATTEMPTS_NETWORKS 256

struct attempts {
    struct attempts_network {
        uint64_t network;                       /* see address_network() */
        uint64_t failed_ns[ATTEMPTS_LIMIT_MAX]; /* a ring; 0: none */
        size_t next;
    } networks[ATTEMPTS_NETWORKS]; /* all zero: nobody has failed */
};

void attempts_add_failed(struct attempts *attempts, uint64_t network, uint64_t now_ns);
/* Whether fewer than `limit` (at most ATTEMPTS_LIMIT_MAX) failed within the last minute. */
bool attempts_are_allowed(const struct attempts *attempts, uint64_t network, uint32_t limit, uint64_t now_ns);

#endif
