/* SPDX-License-Identifier: MIT */
/* Settings that depend on several options or on the loaded scene's cameras. */
#ifndef FARLIGHT_OPTIONS_COMPLETE_H
#define FARLIGHT_OPTIONS_COMPLETE_H

#include "options/job.h"

/* Completes settings that depend on several options, after the command line was read. `is_series`: the output is a
 * pattern of paths. */
bool cli_job_complete(struct cli_job *job, bool is_series);
/* Completes the settings of a window, which has no output. */
bool cli_job_complete_view(struct cli_job *job);
bool cli_writes_to_stdout(const struct cli_job *job);
/* Shows a ground beneath models without lights, in pictures for viewing, unless a camera of theirs is used. */
void cli_choose_ground(const struct cli_job *job, struct message_render *render, const struct fl_scene *scene);
/* A camera by name or number; without one the model's first, unless keys or something else place it. `framed`: the
 * node that is to be in view, name or number; NULL: all. */
bool cli_find_camera(struct message_render *render, const char *camera, const char *framed, bool is_placed,
                     const struct fl_scene *scene, struct fl_error *error);
/* Places of the camera are the model's: moves them to the scene, whose origin may be another. */
void cli_move_camera(struct cli_job *job, const double origin[3]);

#endif
