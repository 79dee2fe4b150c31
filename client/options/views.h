/* SPDX-License-Identifier: MIT */
/* Options of several views in a picture, of lenses and of frames made from depth layers. */
#ifndef FARLIGHT_OPTIONS_VIEWS_H
#define FARLIGHT_OPTIONS_VIEWS_H

#include "options/job.h"

/* Sets an option of views; ARGP_ERR_UNKNOWN: it is none of them. */
error_t cli_views_set(struct cli_job *job, const char *option, const char *value);
/* Sets the fields of `render`, once all options are read. `is_series`: frames may be made from others. */
bool cli_views_complete(struct cli_job *job, bool is_series);
/* Checks that the final range has frames to make from others, if this is requested. */
bool cli_views_check_range(const struct cli_job *job, struct fl_error *error);
/* True if each view is a file of its own. */
bool cli_views_are_files(const struct cli_job *job);

#endif
