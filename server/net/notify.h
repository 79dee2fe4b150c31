/* SPDX-License-Identifier: MIT */
/* Tells the service manager how we are: one datagram to $NOTIFY_SOCKET, as sd_notify(3) describes. */
#ifndef FARLIGHT_NET_NOTIFY_H
#define FARLIGHT_NET_NOTIFY_H

/* "READY=1", "STOPPING=1", "RELOADING=1", one assignment a line. Does nothing where nobody asked to be told. */
void notify_manager(const char *state);

#endif
