/* SPDX-License-Identifier: MIT */
/* Options of a series of frames. */
#ifndef FARLIGHT_CLI_JOBS_SERIES_H
#define FARLIGHT_CLI_JOBS_SERIES_H

#include "options/job.h"

/* Parser for use as a child parser; its input is a struct cli_job. */
const struct argp *cli_series_argp(void);
/* Sets an option as the command line "--OPTION VALUE" does. ARGP_ERR_UNKNOWN: there is none. */
error_t cli_series_set(struct cli_job *job, const char *option, const char *value);
/* Runs cli_job_complete() for a series, and completes options that only a series has. */
bool cli_series_complete(struct cli_job *job);
void cli_series_finish(struct cli_job *job);

#endif
