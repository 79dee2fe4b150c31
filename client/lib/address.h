/* SPDX-License-Identifier: MIT */
/* Addresses of daemons. */
#ifndef FARLIGHT_CLIENT_LIB_ADDRESS_H
#define FARLIGHT_CLIENT_LIB_ADDRESS_H

#include "lib/farlight.h"

/* Connects a socket to "unix:PATH" or "tcp:HOST:PORT"; -1 on failure. `local`: see fl_connection_is_local. */
int fl_address_connect(const char *address, uint64_t deadline_ns, int interrupt_fd, bool *local,
                       struct fl_error *error);

#endif
