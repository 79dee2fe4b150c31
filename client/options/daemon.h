/* SPDX-License-Identifier: MIT */
/* The daemon of a command: its address, its key, and connecting. */
#ifndef FARLIGHT_OPTIONS_DAEMON_H
#define FARLIGHT_OPTIONS_DAEMON_H

#include "options/retry.h"

#include <argp.h>

/* The key file for a daemon: --key, or for a TCP address FARLIGHT_KEY. NULL: none. */
const char *cli_key_file(const char *server, const char *given);

struct cli_daemon {
    const char *server, *key_file; /* options as typed */
    struct cli_retries retries;
};
/* Parser of --server, --key, --retry-for and --lost-after, for use as a child parser; its input is a struct
 * cli_daemon. */
extern const struct argp cli_daemon_argp;
/* Connects; the call is interruptible. It tries again for the time of --retry-for, if given. Without --server
 * FARLIGHT_SERVER counts; if neither names a daemon, a private one is started, or with `must_be_named` the
 * error is FL_ERROR_ARGUMENT. */
struct fl_connection *cli_daemon_connect(const struct cli_daemon *daemon, const char *name, bool must_be_named,
                                         struct fl_error *error);

#endif
