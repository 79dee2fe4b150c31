/* SPDX-License-Identifier: MIT */
/* How long a connection's client may take for what it does. */
#ifndef FARLIGHT_NET_PATIENCE_H
#define FARLIGHT_NET_PATIENCE_H

#include <stdint.h>

struct connection;

/* Ends the connection if its client took too long. */
void patience_check(struct connection *connection, uint64_t now_ns);
/* After how many nanoseconds to check again. */
uint64_t patience_next_check_ns(const struct connection *connection, uint64_t now_ns);

#endif
