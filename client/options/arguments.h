/* SPDX-License-Identifier: MIT */
/* The options of a job: those that are fields of `render` (fields.h), and those that are more than a field. */
#ifndef FARLIGHT_OPTIONS_ARGUMENTS_H
#define FARLIGHT_OPTIONS_ARGUMENTS_H

#include "options/job.h"

/* A child parser; its input is a struct cli_job. */
const struct argp *cli_job_argp(void);
/* Likewise, without the options of output, tracer and first hits. */
const struct argp *cli_picture_argp(void);
/* Likewise, without the options of output. */
const struct argp *cli_views_argp(void);
/* Likewise, of pictures of many models. */
const struct argp *cli_thumbnail_argp(void);
/* Likewise for a window, without the options of files; samples, integrator and encoding have other defaults
 * there. */
const struct argp *cli_view_argp(void);
/* Likewise for a page in a browser, whose window has its size, and which chooses clips itself. */
const struct argp *cli_web_argp(void);
/* The defaults, then FARLIGHT_*; before the command line is read. */
bool cli_job_begin(struct cli_job *job, struct message_render defaults);
/* As if "--OPTION VALUE" had been typed; NULL for an option without a value. ARGP_ERR_UNKNOWN: there is none. */
error_t cli_job_set(struct cli_job *job, const char *option, const char *value);
/* "environment", "transparent" or a colour: "#rrggbb". */
error_t cli_set_background(struct cli_job *job, const char *field, const char *value);
error_t cli_set_environment_rotation(struct cli_job *job, const char *field, const char *value);

#endif
