/* SPDX-License-Identifier: MIT */
/* Sealing and opening of a connection's bytes, through its link. */
#ifndef FARLIGHT_NET_SEALING_H
#define FARLIGHT_NET_SEALING_H

#include <stdbool.h>
#include <stddef.h>

struct connection;
struct iovec;

/* Seals as many waiting bytes as fit, and gets the next bytes to send. Returns the number of parts: 1, or 0 for
 * none. */
size_t sealing_gather(struct connection *connection, struct iovec *part);
/* Whether everything is sent, the final record included if one is due. */
bool sealing_is_done(const struct connection *connection);
/* Opens the next record and appends it to `in`. False: no whole record has arrived, or the link has ended. */
bool sealing_open_next(struct connection *connection);

#endif
