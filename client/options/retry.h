/* SPDX-License-Identifier: MIT */
/* Lost daemons that may come back. */
#ifndef FARLIGHT_OPTIONS_RETRY_H
#define FARLIGHT_OPTIONS_RETRY_H

#include "lib/farlight.h"

/* When a daemon counts as lost, and how long a lost one is waited for, without a new frame in between. */
struct cli_retries {
    bool has_count, has_duration;
    unsigned count; /* in a row */
    double for_s;
    unsigned lost_after_ms; /* as of fl_connect */
};

/* Whether the same command may succeed later: the daemon is lost, or says that its state will change. */
bool cli_is_temporary(const struct fl_error *error);
/* The pause before the next try after this number of failures in a row, at least 1: it doubles each time, within
 * bounds, and differs by a quarter by chance, so that many clients of one daemon do not come back at once. */
uint32_t cli_retry_pause_ms(unsigned failures, uint32_t min_ms);
bool cli_retry_wait(uint32_t pause_ms, struct fl_error *error); /* false: interrupted */
/* A value of --retry-for; false: the error says what is allowed. */
bool cli_read_retry_for(const char *value, struct cli_retries *retries, struct fl_error *error);
/* The same of --lost-after. */
bool cli_read_lost_after(const char *value, struct cli_retries *retries, struct fl_error *error);
/* The time for a connection of which `left_s` are left to retry: at least a second, at most the library's own
 * time, which 0 stands for. */
unsigned cli_connect_timeout_ms(double left_s);

#endif
