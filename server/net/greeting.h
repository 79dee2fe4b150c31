/* SPDX-License-Identifier: MIT */
/* First bytes of a connection: the exchange of a sealed link, if it is one; then hello in, reply out. */
#ifndef FARLIGHT_NET_GREETING_H
#define FARLIGHT_NET_GREETING_H

#include <stdbool.h>
#include <stdint.h>

struct connection;

/* Processes the bytes so far. A whole hello is answered; then the connection is open, or about to close if the
 * client was refused. */
void greeting_process(struct connection *connection);
/* Sends the reason for its refusal to a client of which nothing was read, as far as the kernel accepts the
 * bytes at once. */
void greeting_turn_away(int fd, const char *why, uint64_t capabilities);
/* Reserves space for messages of any size, if there is none yet. False: out of memory. */
bool greeting_reserve_input(struct connection *connection);
/* Sends the refusal of a wrong key, after its delay. */
void greeting_refuse_key(struct connection *connection);

#endif
