/* SPDX-License-Identifier: MIT */
/* HTTP and WebSockets: the page for those who have the link, and a seat for each of its WebSockets. */
#ifndef FARLIGHT_CLIENT_WEB_GATEWAY_H
#define FARLIGHT_CLIENT_WEB_GATEWAY_H

#include "web/seat.h"

struct gateway_options {
    struct seat_options seat; /* without changed and user */
    char host[64];            /* an IPv4 address */
    int port;                 /* 0: the kernel chooses one */
    unsigned viewers;         /* WebSockets at once */
    int (*interrupt_signal)(void);
};

/* Reads "HOST:PORT". *is_loopback: only this machine can come there. */
bool gateway_read_listen(const char *text, struct gateway_options *options, bool *is_loopback,
                         struct fl_error *error);
/* Prints the link and serves until there is a signal, which is FL_ERROR_INTERRUPTED. */
bool gateway_run(const struct gateway_options *options, struct fl_error *error);

#endif
