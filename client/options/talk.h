/* SPDX-License-Identifier: MIT */
/* What people read on standard error, and the exit status that goes with it. */
#ifndef FARLIGHT_OPTIONS_TALK_H
#define FARLIGHT_OPTIONS_TALK_H

#include "lib/farlight.h"

#include <jansson.h>

/* Exit statuses; 128 + signal besides. */
enum cli_status {
    CLI_DONE = 0,
    CLI_FAILED = 1, /* of `compare`: a figure is beyond its limit */
    CLI_USAGE = 2,
    CLI_TROUBLE = 2, /* of `compare`: there is no figure */
    CLI_TRY_AGAIN = 75
};

/* "farlight: FIELD: TEXT (REMEDY)"; returns the exit status that belongs to the error. */
int cli_report(const struct fl_error *error);
/* A note about a model: warnings always, plain information only if `chatty`. */
void cli_note(const struct fl_note *note, bool chatty);
/* On standard output; characters that could control a terminal or change the order of a line are not printed. */
void cli_print_name(const char *name);
bool cli_is_terminal(int fd); /* one that can move its cursor */
/* How JSON is written: names say all that they hold, in escapes that do nothing to a terminal. */
#define CLI_JSON (JSON_COMPACT | JSON_ENSURE_ASCII)

#endif
