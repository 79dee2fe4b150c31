/* SPDX-License-Identifier: MIT */
/* The options of a job: those that are fields of `render` (fields.h), and those that are more than a field. */
#ifndef FARLIGHT_OPTIONS_ARGUMENTS_H
#define FARLIGHT_OPTIONS_ARGUMENTS_H

#include "options/job.h"

/* Sets of a job's options. */
enum cli_options {
    CLI_OPTIONS_ALL,
    CLI_OPTIONS_PICTURE,   /* no options of output, tracer and first hits */
    CLI_OPTIONS_VIEWS,     /* no options of output */
    CLI_OPTIONS_THUMBNAIL, /* pictures of many models */
    CLI_OPTIONS_WINDOW,    /* no options of files; samples, integrator and encoding have other defaults */
    CLI_OPTIONS_PAGE,      /* a page in a browser, which chooses size and clips itself */
    CLI_OPTIONS_COUNT
};
/* Parser of a set, for use as a child parser; its input is a struct cli_job. */
const struct argp *cli_options_argp(enum cli_options set);
/* Sets the defaults, then FARLIGHT_*; before the command line is read. */
bool cli_job_begin(struct cli_job *job, struct message_render defaults);
/* Sets an option as the command line "--OPTION VALUE" does; NULL for an option without a value.
 * ARGP_ERR_UNKNOWN: there is none. */
error_t cli_job_set(struct cli_job *job, const char *option, const char *value);
/* Reads "environment", "transparent" or a colour: "#rrggbb". */
error_t cli_set_background(struct cli_job *job, const char *field, const char *value);
error_t cli_set_environment_rotation(struct cli_job *job, const char *field, const char *value);

#endif
