/* SPDX-License-Identifier: MIT */
/* Which daemon is asked, with which key, and the way to it. */
#ifndef FARLIGHT_OPTIONS_DAEMON_H
#define FARLIGHT_OPTIONS_DAEMON_H

#include "options/retry.h"

#include <argp.h>

/* The key file for a daemon: that of --key, else, for a TCP address, of FARLIGHT_KEY. NULL: none. */
const char *cli_key_file(const char *server, const char *given);

struct cli_daemon {
    const char *server, *key_file; /* as typed */
    struct cli_retries retries;
};
/* --server, --key, --retry-for and --lost-after: a child parser; its input is a struct cli_daemon. */
extern const struct argp cli_daemon_argp;
/* Interruptible from then on. Tries again for the time of --retry-for, if that was given. Without --server
 * FARLIGHT_SERVER counts; if neither names a daemon, a private one is started, or (`must_be_named`) it is
 * FL_ERROR_ARGUMENT. */
struct fl_connection *cli_daemon_connect(const struct cli_daemon *daemon, const char *name, bool must_be_named,
                                         struct fl_error *error);

#endif
