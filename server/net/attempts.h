/* SPDX-License-Identifier: MIT */
/* Spaces sealed handshakes by network: so many within a second at once, then one after the other. Those beyond
 * wait for their turn, whatever their key: many people may have one address, and wrong keys of one of them must
 * not lock out the others. A key has 256 random bits, so the rate bounds what handshakes cost, not what guesses
 * find. Pure: the caller passes the time. One thread. */
#ifndef FARLIGHT_NET_ATTEMPTS_H
#define FARLIGHT_NET_ATTEMPTS_H

#include <stdint.h>

/* With more networks than this, the one that has been quiet for longest is forgotten. */
#define ATTEMPTS_NETWORKS 256

struct attempts {
    struct attempts_network {
        uint64_t network;          /* see address_network() */
        uint64_t next_ns;          /* when all that it has begun would be through, one after the other */
    } networks[ATTEMPTS_NETWORKS]; /* all zero: none has begun */
};

/* 0: a handshake may begin, and is counted. Else nothing is counted, and one may begin after this time. */
uint64_t attempts_wait_ns(struct attempts *attempts, uint64_t network, uint32_t per_second, uint64_t now_ns);

#endif
