/* SPDX-License-Identifier: MIT */
/* The options of a job: those that are fields of `render` (fields.h), and those that are more than a field. */
#ifndef FARLIGHT_OPTIONS_ARGUMENTS_H
#define FARLIGHT_OPTIONS_ARGUMENTS_H

#include "options/job.h"

/* Parsers of the options of a job, for use as child parsers; their input is a struct cli_job. The first one has
 * all options. */
const struct argp *cli_job_argp(void);
/* No options of output, tracer and first hits. */
const struct argp *cli_picture_argp(void);
/* No options of output. */
const struct argp *cli_views_argp(void);
/* Pictures of many models. */
const struct argp *cli_thumbnail_argp(void);
/* A window: no options of files; samples, integrator and encoding have other defaults. */
const struct argp *cli_view_argp(void);
/* A page in a browser, which chooses size and clips itself. */
const struct argp *cli_web_argp(void);
/* Sets the defaults, then FARLIGHT_*; before the command line is read. */
bool cli_job_begin(struct cli_job *job, struct message_render defaults);
/* Sets an option as the command line "--OPTION VALUE" does; NULL for an option without a value.
 * ARGP_ERR_UNKNOWN: there is none. */
error_t cli_job_set(struct cli_job *job, const char *option, const char *value);
/* Reads "environment", "transparent" or a colour: "#rrggbb". */
error_t cli_set_background(struct cli_job *job, const char *field, const char *value);
error_t cli_set_environment_rotation(struct cli_job *job, const char *field, const char *value);

#endif
