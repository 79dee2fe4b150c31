/* SPDX-License-Identifier: MIT */
/* The models of a command line: several of them, their places, and one from standard input. */
#ifndef FARLIGHT_OPTIONS_MODELS_H
#define FARLIGHT_OPTIONS_MODELS_H

#include "lib/farlight.h"

#include <argp.h>

struct cli_job;

/* An argument that is no option: "-" is standard input. Its place is set by a later option; one that has a place
 * is shown once more for each further place. */
error_t cli_set_model(struct cli_job *job, const char *path);
error_t cli_set_place(struct cli_job *job, const char *field, const char *value);
/* Turns the models so that --up, an axis of theirs, is y; those that are placed stay. */
bool cli_turn_models(struct cli_job *job);
bool cli_has_input(const struct cli_job *job); /* a model is standard input */
/* Whether the files of models and environment can be read. */
bool cli_check_models(const struct cli_job *job, struct fl_error *error);
/* Whether --watch, if it is given, has files to watch. */
bool cli_check_watch(struct cli_job *job);
/* Reads standard input, if a model is that, into a file in memory. Interruptible; refused on a terminal. */
bool cli_read_input(struct cli_job *job, struct fl_error *error);
bool cli_open_input(int *input_fd, struct fl_error *error); /* the same without a job */

#endif
