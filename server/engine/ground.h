/* SPDX-License-Identifier: MIT */
/* Place of a job's ground: beneath everything that the scene shows, at any time of the job's clips. */
#ifndef FARLIGHT_ENGINE_GROUND_H
#define FARLIGHT_ENGINE_GROUND_H

#include "engine/animation.h"

/* Places the ground, equally in all frames of a scene's revision, whatever part of them the job renders. Nothing
 * visible: a radius of 0. False: a clip does not exist, or out of memory. */
bool ground_place(const struct engine_job *job, const struct scene *scene, struct animation_bounds *bounds,
                  struct frame_ground *ground, struct error *error);

#endif
