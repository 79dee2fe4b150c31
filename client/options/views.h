/* SPDX-License-Identifier: MIT */
/* Options of several views in a picture, of lenses and of frames that are made of depth layers. */
#ifndef FARLIGHT_OPTIONS_VIEWS_H
#define FARLIGHT_OPTIONS_VIEWS_H

#include "options/job.h"

/* Sets what an option of views says; ARGP_ERR_UNKNOWN: it is none of them. */
error_t cli_views_set(struct cli_job *job, const char *option, const char *value);
/* Their fields of `render`, once all options are read. `is_series`: frames may be made from others. */
bool cli_views_complete(struct cli_job *job, bool is_series);
/* Whether the range, which is known, has frames to be made from others, if that is asked for. */
bool cli_views_check_range(const struct cli_job *job, struct fl_error *error);
/* Whether each view is a file of its own. */
bool cli_views_are_files(const struct cli_job *job);

#endif
