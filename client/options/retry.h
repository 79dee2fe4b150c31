/* SPDX-License-Identifier: MIT */
/* Retries after the loss of a daemon. */
#ifndef FARLIGHT_OPTIONS_RETRY_H
#define FARLIGHT_OPTIONS_RETRY_H

#include "lib/farlight.h"

/* The silence after which a daemon counts as lost, and limits of retries without a new frame in between. */
struct cli_retries {
    bool has_count, has_duration;
    unsigned count; /* consecutive retries */
    double for_s;
    unsigned lost_after_ms; /* see fl_connect_options */
};

/* True if the same command may succeed later: the daemon is lost, or reports a temporary state. */
bool cli_is_temporary(const struct fl_error *error);
/* The pause after this number of consecutive failures, at least 1: it doubles each time, within bounds, and
 * varies randomly by a quarter, so that many clients of a daemon do not return at once. */
uint32_t cli_retry_pause_ms(unsigned failures, uint32_t min_ms);
bool cli_retry_wait(uint32_t pause_ms, struct fl_error *error); /* false: interrupted */
/* Reads the value of --retry-for; false: *error has the allowed values. */
bool cli_read_retry_for(const char *value, struct cli_retries *retries, struct fl_error *error);
/* Reads the value of --lost-after. */
bool cli_read_lost_after(const char *value, struct cli_retries *retries, struct fl_error *error);
/* Timeout of a connection if `left_s` remain for retries: at least a second, at most the library's default, for
 * which 0 stands. */
unsigned cli_connect_timeout_ms(double left_s);

#endif
