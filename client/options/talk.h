/* SPDX-License-Identifier: MIT */
/* Messages on standard error, and exit statuses. */
#ifndef FARLIGHT_OPTIONS_TALK_H
#define FARLIGHT_OPTIONS_TALK_H

#include "lib/farlight.h"

#include <jansson.h>

/* Exit statuses, besides 128 + signal. */
enum cli_status {
    CLI_DONE = 0,
    CLI_FAILED = 1, /* `compare`: a figure exceeds its limit */
    CLI_USAGE = 2,
    CLI_TROUBLE = 2, /* `compare`: there is no figure */
    CLI_TRY_AGAIN = 75
};

/* Prints "farlight: FIELD: TEXT (REMEDY)"; returns the exit status of the error. */
int cli_report(const struct fl_error *error);
/* Prints a note about a model: warnings always, plain information only if `chatty`. */
void cli_note(const struct fl_note *note, bool chatty);
/* Prints a name to standard output, without characters that could control a terminal or reorder a line. */
void cli_print_name(const char *name);
bool cli_is_terminal(int fd); /* true for a terminal that can move its cursor */
/* Flags for writing JSON: names are complete, in escapes that are harmless for a terminal. */
#define CLI_JSON (JSON_COMPACT | JSON_ENSURE_ASCII)

#endif
