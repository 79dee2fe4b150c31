/* SPDX-License-Identifier: MIT */
/* A connection's bytes by way of its link, where it is sealed. */
#ifndef FARLIGHT_NET_SEALING_H
#define FARLIGHT_NET_SEALING_H

#include <stdbool.h>
#include <stddef.h>

struct connection;
struct iovec;

/* Seals as much of what waits as fits, and gives what is to be sent next; the number of parts, 1 or 0: nothing. */
size_t sealing_gather(struct connection *connection, struct iovec *part);
/* Nothing is left to be sent, the end included where there is to be one. */
bool sealing_is_done(const struct connection *connection);
/* Opens the next record, behind what is in `in`. False: none has come whole, or nothing more can come. */
bool sealing_open_next(struct connection *connection);

#endif
