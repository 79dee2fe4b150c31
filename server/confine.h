/* SPDX-License-Identifier: MIT */
/* The sandbox of a process that serves. */
#ifndef FARLIGHT_CONFINE_H
#define FARLIGHT_CONFINE_H

#include "base/error.h"
#include "config.h"

#include <stdbool.h>

/* Confines this process to the files of drivers, the caches of compiled programs, the trace file `trace_path`
 * ("": none) and the folder `store_path` ("": none), which are created if they are missing. Called before any
 * thread is started, unless server.sandbox says no. False and *error: it failed, and clients must not be
 * served. */
bool confine(const struct config *config, const char *trace_path, const char *store_path, struct error *error);

#endif
