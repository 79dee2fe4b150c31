/* SPDX-License-Identifier: MIT */
/* The first bytes of a connection: what seals it, if anything does; hello in, reply out. */
#ifndef FARLIGHT_NET_GREETING_H
#define FARLIGHT_NET_GREETING_H

struct connection;

/* Looks at what has come so far. Once the hello is whole it is answered, and the connection is open, or, where the
 * client is turned away, about to close. */
void greeting_process(struct connection *connection);
/* The client's key was wrong, and it has waited for so long that it may be told so. */
void greeting_refuse_key(struct connection *connection);

#endif
