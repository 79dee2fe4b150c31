/* SPDX-License-Identifier: MIT */
/* Keeps what others can cause without an end from filling the log. */
#ifndef FARLIGHT_BASE_LOG_RATE_H
#define FARLIGHT_BASE_LOG_RATE_H

#include <stdbool.h>
#include <stdint.h>

/* Whether a line about this source (a user, a network), of this kind (a constant string), is to be written: a few
 * of each are within some seconds. Once they may be written again, a line says how many were not. Any thread. */
bool log_is_due(uint64_t source, const char *kind);

#endif
