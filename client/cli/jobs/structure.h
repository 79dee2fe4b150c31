/* SPDX-License-Identifier: MIT */
/* A tracer's report on its structure (structure_row in protocol/messages.def). */
#ifndef FARLIGHT_CLI_JOBS_STRUCTURE_H
#define FARLIGHT_CLI_JOBS_STRUCTURE_H

#include "options/progress.h"

#include <jansson.h>

#define CLI_WARNED_MAX 16u

/* Sets "structure", an object of all rows, lengths as "static/cell_metres"; and "warnings", an array of
 * strings. */
void cli_structure_set_json(json_t *object, const struct fl_frame *frame);

/* Names of rows whose warning was printed. */
struct cli_warned {
    char names[CLI_WARNED_MAX][FL_STRUCTURE_NAME_BYTES];
    size_t count;
};
/* Prints warnings about missing parts of the picture, once for each row. */
void cli_structure_warn(const struct fl_frame *frame, struct cli_warned *warned, struct cli_progress *progress);

#endif
