/* SPDX-License-Identifier: MIT */
/* Log lines on stderr: "LEVEL module: text". Thread-safe: a line is one write. */
#ifndef FARLIGHT_BASE_LOG_H
#define FARLIGHT_BASE_LOG_H

#include <stdbool.h>

enum log_level { LOG_ERROR, LOG_WARNING, LOG_INFO, LOG_DEBUG, LOG_LEVEL_COUNT };

void log_set_level(enum log_level level);         /* default LOG_INFO */
const char *log_level_name(enum log_level level); /* "error" .. "debug" */
void log_write(enum log_level level, const char *module, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#endif
