/* SPDX-License-Identifier: MIT */
/* Sockets on which the service manager listens before the daemon runs and between its runs: sd_listen_fds(3),
 * without libsystemd.
 */
#ifndef FARLIGHT_NET_ACTIVATION_H
#define FARLIGHT_NET_ACTIVATION_H

#include <stddef.h>

#define ACTIVATION_FD_FIRST 3
#define ACTIVATION_NAME_BYTES 64

/* The number of descriptors that the service manager passed to this process, from ACTIVATION_FD_FIRST on; children
 * do not inherit them. 0: the process was not started by socket activation. A second call gives 0: the descriptors
 * have an owner by then. */
size_t activation_take(void);
/* The name of one descriptor in the unit, for messages: that of FileDescriptorName=, or "descriptor N". Call it
 * before activation_take(). */
void activation_name(size_t index, char name[ACTIVATION_NAME_BYTES]);

#endif
