/* SPDX-License-Identifier: MIT */
/* Rate limit for lines in the log that others can cause without end. */
#ifndef FARLIGHT_BASE_LOG_RATE_H
#define FARLIGHT_BASE_LOG_RATE_H

#include <stdbool.h>
#include <stdint.h>

/* Whether a line about this source (a user, a network), of this kind (a constant string), should be written: a
 * few of each may be within some seconds. When they may be written again, a line states the number suppressed.
 * Any thread. */
bool log_is_due(uint64_t source, const char *kind);

#endif
