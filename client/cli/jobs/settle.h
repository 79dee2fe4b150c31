/* SPDX-License-Identifier: MIT */
/* Checks that need the loaded scene. */
#ifndef FARLIGHT_CLI_JOBS_SETTLE_H
#define FARLIGHT_CLI_JOBS_SETTLE_H

#include "options/job.h"

/* Settings that depend on the loaded scene: clips, the objects of the script's keys, the default range of
 * frames, and values derived from it. Call it for each scene. */
bool cli_settle(struct cli_job *job, struct fl_scene *scene, bool is_series, struct fl_error *error);

#endif
