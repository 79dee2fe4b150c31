/* SPDX-License-Identifier: MIT */
/* A thread that carries the bytes of a connection as a slow link would (link.h). */
#ifndef FARLIGHT_CLIENT_LIB_SHAPER_H
#define FARLIGHT_CLIENT_LIB_SHAPER_H

#include "lib/link.h"

struct fl_shaper;

/* Puts a link between the caller and the peer of *fd, a stream socket: *fd becomes the near end of the link, and
 * the shaper owns the socket. On failure *fd is closed and -1. Connections of a process are numbered for
 * fl_link_reset_ns() in the order in which their shapers start. */
struct fl_shaper *fl_shaper_start(const struct fl_link *link, int *fd, struct fl_error *error);
/* Call it after the near end has been closed: waits until what was sent has arrived, for about a second at most.
 */
void fl_shaper_destroy(struct fl_shaper *shaper);

#endif
