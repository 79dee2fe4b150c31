/* SPDX-License-Identifier: MIT */
/* Tells the service manager how we are: one datagram to $NOTIFY_SOCKET, as sd_notify(3) describes. */
#ifndef FARLIGHT_NET_NOTIFY_H
#define FARLIGHT_NET_NOTIFY_H

#include <stdint.h>

/* "READY=1", "STOPPING=1", "RELOADING=1", one assignment a line. Does nothing where nobody asked to be told. */
void notify_manager(const char *state);

/* How often the service manager wants to hear "WATCHDOG=1" from this process at least, in ns; 0: it does not. */
uint64_t notify_watchdog_ns(void);

#endif
