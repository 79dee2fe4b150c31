/* SPDX-License-Identifier: MIT */
/* A job's camera in a frame. Pure: the same scene, job and frame give the same camera, whatever frames came
 * before. */
#ifndef FARLIGHT_ENGINE_ANIMATION_H
#define FARLIGHT_ENGINE_ANIMATION_H

#include "base/error.h"
#include "engine/engine.h"
#include "scene/pose.h"

#include <stdbool.h>
#include <stdint.h>

#define ANIMATION_TIME_MAX_S 1e9 /* the protocol's range of a frame's time, on both sides of 0 */

/* Seconds since `time_origin_frame`; negative before it. */
double animation_time_s(const struct engine_job *job, uint32_t frame);
/* Catmull-Rom through the keys in time; before the first and after the last it stands still. At least one key. */
void animation_key_at(const struct record_camera_key *keys, uint32_t key_count, double time_s,
                      struct record_camera_key *key);
/* Errors that depend on neither the frame nor the scene. */
bool animation_check(const struct engine_job *job, struct error *error);
/* The scene's bounds at the job's time 0, for cameras that show the whole scene. They depend on the scene's
 * revision alone and may be kept from frame to frame. */
struct animation_bounds {
    bool known;
    uint64_t revision;
    float lower[3], upper[3];
    bool reach_known; /* whether `supports` has the vertices' extent in these directions */
    double directions[FRAME_CAMERA_DIRECTIONS][3], supports[FRAME_CAMERA_DIRECTIONS];
    bool ground_known; /* engine/ground.h */
    uint64_t ground_revision;
    struct frame_ground ground;
};
/* Camera of one key; false if its vectors do not span a view. */
bool animation_key_camera(const struct record_camera_key *key, const char *field, struct frame_camera *camera,
                          struct error *error);
/* Distance along the view; 0 where the point is not in front. */
float animation_distance(const struct frame_camera *camera, const float point_world[3]);
struct animation_view {
    struct frame_camera camera;
    float focus; /* distance along the view to the look-at point, or to the middle of the scene; metres */
};
/* Camera at a time of the job. `pose`: the scene at that time, whose view overrides the job's as far as it is
 * given; NULL: the scene as it was committed. `bounds` may be NULL. */
bool animation_view(const struct engine_job *job, const struct scene *scene, const struct scene_pose *pose,
                    double time_s, struct animation_bounds *bounds, struct animation_view *view,
                    struct error *error);

#endif
