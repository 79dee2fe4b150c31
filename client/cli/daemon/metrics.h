/* SPDX-License-Identifier: MIT */
/* A daemon's state in Prometheus' text format, version 0.0.4. Names follow its conventions: base units,
 * `_total` for counters. Clients and scenes are counted, not named, as each name would be a time series of
 * its own. */
#ifndef FARLIGHT_CLI_DAEMON_METRICS_H
#define FARLIGHT_CLI_DAEMON_METRICS_H

#include "protocol/messages.h"

#include <stdio.h>

/* `reply` NULL: the daemon did not answer, so that farlight_up is 0 and there is nothing else. */
void metrics_print(FILE *out, const struct message_stats_reply *reply);

#endif
