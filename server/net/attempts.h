/* SPDX-License-Identifier: MIT */
/* Limits the rate of sealed handshakes by network: a number within a second at once, then one after the other.
 * Further ones wait for their turn, whatever their key: many people may share an address, and one's wrong keys
 * must not lock out the others. A key has 256 random bits, so the rate limits the cost of handshakes, not the
 * success of guesses. Pure: the caller passes the time. One thread. */
#ifndef FARLIGHT_NET_ATTEMPTS_H
#define FARLIGHT_NET_ATTEMPTS_H

#include <stdint.h>

/* Maximum of networks; with more, the one that has been quiet for longest is dropped. */
#define ATTEMPTS_NETWORKS 256

struct attempts {
    struct attempts_network {
        uint64_t network;          /* see address_network() */
        uint64_t next_ns;          /* end of all that it has begun, if they ran one after the other */
    } networks[ATTEMPTS_NETWORKS]; /* zero: none has begun */
};

/* Time after which a handshake may begin; 0: at once, and it is counted. Otherwise nothing is counted. */
uint64_t attempts_wait_ns(struct attempts *attempts, uint64_t network, uint32_t per_second, uint64_t now_ns);

#endif
