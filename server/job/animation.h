/* SPDX-License-Identifier: MIT */
/* Where a job's camera is in a frame. Pure: the same scene, job and frame give the same camera. */
#ifndef FARLIGHT_JOB_ANIMATION_H
#define FARLIGHT_JOB_ANIMATION_H

#include "base/error.h"
#include "job/engine.h"

#include <stdbool.h>
#include <stdint.h>

/* Seconds since `time_origin_frame`; negative before it. */
double animation_time_s(const struct engine_job *job, uint32_t frame);
/* Catmull-Rom through the keys in time; before the first and after the last it stands still. At least one key. */
void animation_key_at(const struct camera_key *keys, uint32_t key_count, double time_s, struct camera_key *key);
/* Turns a camera about an axis through a point, counterclockwise seen against the axis; false: the axis is 0. */
bool animation_turn(struct frame_camera *camera, const float axis_world[3], const float centre_world[3],
                    double angle);
/* Errors that do not depend on the frame. */
bool animation_check(const struct engine_job *job, const struct scene *scene, struct error *error);
bool animation_camera(const struct engine_job *job, const struct scene *scene, uint32_t frame,
                      struct frame_camera *camera, struct error *error);

#endif
