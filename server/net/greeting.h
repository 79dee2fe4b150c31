/* SPDX-License-Identifier: MIT */
/* The first bytes of a connection: the exchange of a sealed link, if it is one; then hello in, reply out. */
#ifndef FARLIGHT_NET_GREETING_H
#define FARLIGHT_NET_GREETING_H

struct connection;

/* Processes the bytes so far. A whole hello is answered; then the connection is open, or about to close if the
 * client was refused. */
void greeting_process(struct connection *connection);
/* Sends the refusal of a wrong key, after its delay. */
void greeting_refuse_key(struct connection *connection);

#endif
