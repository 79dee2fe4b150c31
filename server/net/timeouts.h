/* SPDX-License-Identifier: MIT */
/* Time limits of a connection. */
#ifndef FARLIGHT_NET_TIMEOUTS_H
#define FARLIGHT_NET_TIMEOUTS_H

#include <stdint.h>

struct connection;

/* Ends the connection if its client has passed a limit. */
void timeouts_check(struct connection *connection, uint64_t now_ns);
/* Time until the next check, in nanoseconds. */
uint64_t timeouts_next_check_ns(const struct connection *connection, uint64_t now_ns);

#endif
