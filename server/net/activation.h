/* SPDX-License-Identifier: MIT */
/* Socket activation: the service manager listens before the daemon runs and between its runs. Does what
 * sd_listen_fds(3) does, without libsystemd. */
#ifndef FARLIGHT_NET_ACTIVATION_H
#define FARLIGHT_NET_ACTIVATION_H

#include <stddef.h>

#define ACTIVATION_FD_FIRST 3
#define ACTIVATION_NAME_BYTES 64

/* Returns the number of descriptors that the service manager passed to this process, from ACTIVATION_FD_FIRST
 * on; children do not inherit them. 0: the process was not started by socket activation. A second call returns
 * 0, as the descriptors have an owner by then. */
size_t activation_take(void);
/* Gets the name of a descriptor in the unit, for messages: that of FileDescriptorName=, or "descriptor N". Call
 * it before activation_take(). */
void activation_name(size_t index, char name[ACTIVATION_NAME_BYTES]);

#endif
