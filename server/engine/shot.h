/* SPDX-License-Identifier: MIT */
/* The content of one frame of a job: poses, camera, lens and noise. Pure: scene, job and frame number determine
 * it, whatever frames came before, so a range may be divided anywhere. */
#ifndef FARLIGHT_ENGINE_SHOT_H
#define FARLIGHT_ENGINE_SHOT_H

#include "engine/animation.h"
#include "engine/view_mailbox.h"

struct shot {
    struct frame_request request;
    struct scene_motion motion; /* owned; no pose: no clip plays */
    float time_s, shutter_s;
};

/* Key frame for `frame`, from whose layers it is made; the frame itself where it is rendered. It follows from the
 * two numbers alone: a range may begin, and be divided, anywhere. */
uint32_t shot_key_frame(const struct engine_job *job, uint32_t frame);
/* `bounds` may be kept from frame to frame, or NULL. On failure there is nothing to finish. */
bool shot_make(struct shot *shot, const struct engine_job *job, const struct scene *scene, uint32_t frame,
               struct animation_bounds *bounds, struct error *error);
/* Makes a shot with the camera and the time of `from` in place of the job's. Noise is the job's own, so that one
 * camera position gives one picture. */
bool shot_make_at(struct shot *shot, const struct engine_job *job, const struct scene *scene,
                  const struct view_camera *from, struct animation_bounds *bounds, struct error *error);
void shot_finish(struct shot *shot);
/* Whether a job can begin: checks the job's terms and its first frame. `bounds` may be NULL. */
bool shot_check(const struct engine_job *job, const struct scene *scene, struct animation_bounds *bounds,
                struct error *error);

#endif
