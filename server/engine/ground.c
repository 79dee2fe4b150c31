/* SPDX-License-Identifier: MIT */
#include "engine/ground.h"

#include <math.h>

/* Number of times at which the lowest point is searched. Geometry that dips below it in between is shown, and
 * hides the ground. */
#define TIMES 17
/* Radius in diagonals of the scene: a sun 1 degree above the horizon casts shadows 57 times as long as things are
 * high. */
#define RADIUS 64.0
/* Distance below the lowest point, in diagonals: a floor of the model's own lies on the ground, and the
 * difference is invisible. */
#define DEPTH (1.0 / 8192.0)

static double job_end_s(const struct engine_job *job, const struct scene *scene)
{
    double end_s = 0.0;
    for (uint32_t i = 0; i < job->clip_count; i++)
        end_s = fmax(end_s, (double)job->clips[i].start_s +
                                scene_clip_duration_s(scene, job->clips[i].clip) / (double)job->clips[i].speed);
    return end_s;
}

/* Extends `reach` to the scene's extent along `down` at a time of the job. */
static bool extend_reach(const struct engine_job *job, const struct scene *scene, double time_s,
                         const double down[1][3], double *reach, struct error *error)
{
    struct scene_pose pose;
    double support;
    if (!scene_pose_evaluate(&pose, scene, job->clips, job->clip_count, time_s, error))
        return false;
    if (scene_supports_below(scene, &pose, 0, NULL, down, &support, 1))
        *reach = fmax(*reach, support);
    scene_pose_finish(&pose);
    return true;
}

static bool find(const struct engine_job *job, const struct scene *scene, struct frame_ground *ground,
                 struct error *error)
{
    const struct record_picture *picture = &job->frame.picture;
    const float up[3] = {picture->ground_up_x, picture->ground_up_y, picture->ground_up_z};
    const double length =
        sqrt((double)up[0] * (double)up[0] + (double)up[1] * (double)up[1] + (double)up[2] * (double)up[2]);
    double down[1][3], reach = -INFINITY, diagonal = 0.0, along = 0.0;
    const uint32_t times = job->clip_count > 0 ? TIMES : 1;
    float lower[3], upper[3];
    *ground = (struct frame_ground){0};
    for (int axis = 0; axis < 3; axis++)
        down[0][axis] = -(double)up[axis] / length;
    for (uint32_t i = 0; i < times; i++)
        if (!extend_reach(job, scene, job_end_s(job, scene) * i / (times > 1 ? times - 1 : 1), down, &reach,
                          error))
            return false;
    if (!isfinite(reach) || !scene_bounds(scene, NULL, lower, upper))
        return true;
    for (int axis = 0; axis < 3; axis++) {
        const double size = (double)upper[axis] - (double)lower[axis];
        diagonal += size * size;
        along += down[0][axis] * ((double)upper[axis] + (double)lower[axis]) / 2.0;
    }
    diagonal = sqrt(diagonal);
    const double off = reach + DEPTH * diagonal - along;
    for (int axis = 0; axis < 3; axis++) {
        ground->centre_world[axis] =
            (float)(((double)upper[axis] + (double)lower[axis]) / 2.0 + off * down[0][axis]);
        ground->normal_world[axis] = (float)-down[0][axis];
    }
    ground->radius = (float)fmin(RADIUS * diagonal, 1e18);
    return true;
}

bool ground_place(const struct engine_job *job, const struct scene *scene, struct animation_bounds *bounds,
                  struct frame_ground *ground, struct error *error)
{
    *ground = (struct frame_ground){0};
    if (!job->frame.picture.ground)
        return true;
    if (bounds && bounds->ground_known && bounds->ground_revision == scene->revision) {
        *ground = bounds->ground;
        return true;
    }
    if (!find(job, scene, ground, error))
        return false;
    if (bounds) {
        bounds->ground_known = true;
        bounds->ground_revision = scene->revision;
        bounds->ground = *ground;
    }
    return true;
}
