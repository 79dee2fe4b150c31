/* SPDX-License-Identifier: MIT */
/* The first bytes of a connection: hello in, reply out. */
#ifndef FARLIGHT_NET_GREETING_H
#define FARLIGHT_NET_GREETING_H

struct connection;

/* Looks at what has come so far. Once the hello is whole it is answered, and the connection is open, or, where the
 * client is turned away, about to close. */
void greeting_process(struct connection *connection);

#endif
