/* SPDX-License-Identifier: MIT */
/* What a link with a rate, a round trip and resets does to bytes, for trying one out. Pure: no clock, no socket;
 * the caller passes the times of one monotonic clock. shaper.h moves the bytes.
 *
 * A link has one queue each way, as a router has: a packet waits until those before it have left, takes its bits
 * divided by the rate, and arrives half of the round trip later. Nothing is lost in it, as TCP hides lost packets
 * behind delay: what remains to be seen of a bad link is a connection that is reset. */
#ifndef FARLIGHT_CLIENT_LIB_LINK_H
#define FARLIGHT_CLIENT_LIB_LINK_H

#include "lib/farlight.h"

#define FL_LINK_PACKET_BYTES 1500u        /* Ethernet's MTU */
#define FL_LINK_QUEUE_NS 100000000u       /* a full queue: the packets in it take this long to leave */
#define FL_LINK_IN_FLIGHT_MAX (16u << 20) /* bytes each way that have not arrived: a large window of TCP */
#define FL_LINK_PACKETS_MIN 1024u         /* each way, small ones among them */

struct fl_link {
    uint64_t bits_per_second; /* each way, headers not counted */
    uint64_t round_trip_ns;
    double reset_chance; /* that a connection is reset within any second: 0 to 0.99 */
    uint64_t seed;
};

/* "2mbit,100ms,1%,seed=7": a rate (kbit, mbit, gbit), a round trip (ms, s), a chance of a reset in each second and
 * the seed of when they come, told apart by their units. What is left out does not limit; the seed is 1 then. */
bool fl_link_parse(const char *text, struct fl_link *link, struct fl_error *error);

/* When connection number `index`, from 0, is reset, after it was made; UINT64_MAX: never. The same for the same
 * link and index. */
uint64_t fl_link_reset_ns(const struct fl_link *link, uint64_t index);

/* The packets each way for which a shaper needs space. */
size_t fl_link_packets(const struct fl_link *link);
/* From when on the queue takes a packet. `free_ns`, of each way: when the last packet has left the queue;
 * initially 0. */
uint64_t fl_link_opens_ns(uint64_t free_ns);
/* Puts a packet into the queue; returns when it arrives. */
uint64_t fl_link_enter(const struct fl_link *link, uint64_t *free_ns, size_t bytes, uint64_t now_ns);

#endif
