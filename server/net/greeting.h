/* SPDX-License-Identifier: MIT */
/* The first bytes of a connection: the exchange of a sealed link, if it is one; then hello in, reply out. */
#ifndef FARLIGHT_NET_GREETING_H
#define FARLIGHT_NET_GREETING_H

#include <stdbool.h>
#include <stdint.h>

struct connection;

/* Processes the bytes so far. A whole hello is answered; then the connection is open, or about to close if the
 * client was refused. */
void greeting_process(struct connection *connection);
/* Says to a client of whom nothing was read yet why it has to go, as far as the kernel takes it at once. */
void greeting_turn_away(int fd, const char *why, uint64_t capabilities);
/* Makes room for messages of any size, where there is none yet. False: out of memory. */
bool greeting_make_room(struct connection *connection);
/* Sends the refusal of a wrong key, after its delay. */
void greeting_refuse_key(struct connection *connection);

#endif
