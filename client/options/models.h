/* SPDX-License-Identifier: MIT */
/* The models of a command line: several of them, their places, and one from standard input. */
#ifndef FARLIGHT_OPTIONS_MODELS_H
#define FARLIGHT_OPTIONS_MODELS_H

#include "lib/farlight.h"

#include <argp.h>

struct cli_job;

/* Adds a model from an argument that is not an option: "-" is standard input. A later option sets its place;
 * each further place shows it once more. */
error_t cli_set_model(struct cli_job *job, const char *path);
error_t cli_set_place(struct cli_job *job, const char *field, const char *value);
/* Turns the models so that the axis --up becomes y; placed models stay. */
bool cli_turn_models(struct cli_job *job);
bool cli_has_input(const struct cli_job *job); /* true if a model is standard input */
/* Checks that the files of models and environment can be read. */
bool cli_check_models(const struct cli_job *job, struct fl_error *error);
/* Checks that --watch, if given, has files to watch. */
bool cli_check_watch(struct cli_job *job);
/* Reads standard input, if a model needs it, into a file in memory. Interruptible; refused on a terminal. */
bool cli_read_input(struct cli_job *job, struct fl_error *error);
bool cli_open_input(int *input_fd, struct fl_error *error); /* reads standard input without a job */

#endif
