/* SPDX-License-Identifier: MIT */
/* The sandbox of a process that serves. */
#ifndef FARLIGHT_CONFINE_H
#define FARLIGHT_CONFINE_H

#include "base/error.h"
#include "config.h"

#include <stdbool.h>

/* Confines this process to what drivers need, to the caches of compiled programs, to the trace file `trace_path`
 * ("": none) and to the folder `store_path` ("": none), which are made where they are missing. Before any thread
 * is started, unless server.sandbox says no. False and *error: it failed, and clients must not be served. */
bool confine(const struct config *config, const char *trace_path, const char *store_path, struct error *error);

#endif
