/* SPDX-License-Identifier: MIT */
/* Reports the daemon's state to the service manager: one datagram to $NOTIFY_SOCKET, as sd_notify(3) describes. */
#ifndef FARLIGHT_NET_NOTIFY_H
#define FARLIGHT_NET_NOTIFY_H

#include <stdint.h>

/* Sends "READY=1", "STOPPING=1", "RELOADING=1", one assignment per line. Does nothing without $NOTIFY_SOCKET. */
void notify_manager(const char *state);

/* Maximum time between two "WATCHDOG=1" of this process that the service manager accepts, in ns; 0: no
 * watchdog. */
uint64_t notify_watchdog_ns(void);

#endif
