/* SPDX-License-Identifier: MIT */
/* Sockets that the service manager listens at before we are there, and while we are not: sd_listen_fds(3), by
 * hand.
 */
#ifndef FARLIGHT_NET_ACTIVATION_H
#define FARLIGHT_NET_ACTIVATION_H

#include <stddef.h>

#define ACTIVATION_FD_FIRST 3
#define ACTIVATION_NAME_BYTES 64

/* How many descriptors were handed over to this very process, from ACTIVATION_FD_FIRST on; children get none of
 * them. 0: we were started otherwise. Asking again gives 0, as they have an owner by then. */
size_t activation_take(void);
/* The name of one of them in the unit, for people: of FileDescriptorName=, or "descriptor N". To be asked before
 * activation_take(). */
void activation_name(size_t index, char name[ACTIVATION_NAME_BYTES]);

#endif
