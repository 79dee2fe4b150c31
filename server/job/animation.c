/* SPDX-License-Identifier: MIT */
#include "job/animation.h"

#include <math.h>
#include <stdio.h>

/* What the protocol lets a key have; a spline through keys near the ends may leave it. */
#define FOV_MIN 0.001f
#define FOV_MAX 3.1f
/* What it lets a frame's camera and time have: composed transforms and splines may go beyond. */
#define PLACE_MAX 1e12f
#define TIME_MAX_S 1e9

double animation_time_s(const struct engine_job *job, uint32_t frame)
{
    return ((double)frame - (double)job->time_origin_frame) / (double)job->frames_per_second;
}

/* ---- keys --------------------------------------------------------------------------------------- */

/* One number of every key, reached by its offset. */
static double number_at(const struct camera_key *key, size_t offset)
{
    return (double)*(const float *)(const void *)((const char *)key + offset);
}

/* Slope at a key: that of the line between its neighbours, at the ends of that to the only one. With keys at
 * equal distances this is the spline of Catmull and Rom (1974). */
static double slope_at(const struct camera_key *keys, uint32_t count, uint32_t i, size_t offset)
{
    const struct camera_key *before = &keys[i ? i - 1 : i], *after = &keys[i + 1 < count ? i + 1 : i];
    double seconds = (double)after->time_s - (double)before->time_s;
    return (number_at(after, offset) - number_at(before, offset)) / seconds;
}

static float hermite(const struct camera_key *keys, uint32_t count, uint32_t i, double time_s, size_t offset)
{
    double seconds = (double)keys[i + 1].time_s - (double)keys[i].time_s;
    double t = (time_s - (double)keys[i].time_s) / seconds, t2 = t * t, t3 = t2 * t;
    double from = number_at(&keys[i], offset), to = number_at(&keys[i + 1], offset);
    double slope_from = slope_at(keys, count, i, offset) * seconds;
    double slope_to = slope_at(keys, count, i + 1, offset) * seconds;
    return (float)((2 * t3 - 3 * t2 + 1) * from + (t3 - 2 * t2 + t) * slope_from + (3 * t2 - 2 * t3) * to +
                   (t3 - t2) * slope_to);
}

void animation_key_at(const struct camera_key *keys, uint32_t key_count, double time_s, struct camera_key *key)
{
    uint32_t last = key_count - 1;
    if (!(time_s > (double)keys[0].time_s)) {
        *key = keys[0];
        return;
    }
    if (!(time_s < (double)keys[last].time_s)) {
        *key = keys[last];
        return;
    }
    uint32_t i = 0;
    while (time_s >= (double)keys[i + 1].time_s)
        i++;
    *key = (struct camera_key){.time_s = (float)time_s};
    for (size_t axis = 0; axis < 3; axis++) {
        size_t step = axis * sizeof(float);
        key->eye_world[axis] = hermite(keys, key_count, i, time_s, offsetof(struct camera_key, eye_world) + step);
        key->look_at_world[axis] =
            hermite(keys, key_count, i, time_s, offsetof(struct camera_key, look_at_world) + step);
        key->up_world[axis] = hermite(keys, key_count, i, time_s, offsetof(struct camera_key, up_world) + step);
    }
    float fov_y = hermite(keys, key_count, i, time_s, offsetof(struct camera_key, fov_y));
    key->fov_y = fminf(fmaxf(fov_y, FOV_MIN), FOV_MAX);
}

static bool camera_from_key(const struct camera_key *key, const char *field, struct frame_camera *camera,
                            struct error *error)
{
    if (frame_camera_look_at(camera, key->eye_world, key->look_at_world, key->up_world, key->fov_y))
        return true;
    error_set(error, ERROR_INVALID, field, "at %g s the eye, what it looks at and up do not span a view",
              (double)key->time_s);
    return error_remedy(error, "eye and look_at must differ, and up must not be parallel to the view");
}

/* ---- orbit -------------------------------------------------------------------------------------- */

bool animation_turn(struct frame_camera *camera, const float axis_world[3], const float centre_world[3],
                    double angle)
{
    double axis[3], length = 0.0;
    for (int i = 0; i < 3; i++)
        length += (double)axis_world[i] * (double)axis_world[i];
    length = sqrt(length);
    if (!(length > 0.0))
        return false;
    for (int i = 0; i < 3; i++)
        axis[i] = (double)axis_world[i] / length;
    /* Rodrigues' formula as a matrix. */
    double c = cos(angle), s = sin(angle), turn[3][3];
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++)
            turn[row][column] = (row == column ? c : 0.0) + (1.0 - c) * axis[row] * axis[column];
    }
    for (int i = 0; i < 3; i++) {
        int next = (i + 1) % 3, after = (i + 2) % 3;
        turn[next][i] += s * axis[after];
        turn[i][next] -= s * axis[after];
    }
    float *m = camera->world_from_view;
    for (int column = 0; column < 4; column++) {
        double v[3];
        for (int row = 0; row < 3; row++)
            v[row] = (double)m[4 * row + column] - (column == 3 ? (double)centre_world[row] : 0.0);
        for (int row = 0; row < 3; row++) {
            double turned = turn[row][0] * v[0] + turn[row][1] * v[1] + turn[row][2] * v[2];
            m[4 * row + column] = (float)(turned + (column == 3 ? (double)centre_world[row] : 0.0));
        }
    }
    return true;
}

static void auto_camera(const struct engine_job *job, const struct scene *scene, struct frame_camera *camera,
                        float centre_world[3])
{
    float lower[3], upper[3];
    if (!scene_bounds(scene, NULL, lower, upper)) {
        /* Nothing but the environment to see: any place will do. */
        for (int axis = 0; axis < 3; axis++) {
            lower[axis] = -1.0f;
            upper[axis] = 1.0f;
        }
    }
    for (int axis = 0; axis < 3; axis++)
        centre_world[axis] = (float)(((double)lower[axis] + (double)upper[axis]) / 2);
    frame_camera_auto(camera, lower, upper, (float)job->frame.width / (float)job->frame.height);
}

static bool orbit_camera(const struct engine_job *job, const struct scene *scene, double time_s,
                         struct frame_camera *camera, struct error *error)
{
    float centre_world[3], axis_world[3] = {0.0f, 1.0f, 0.0f};
    if (job->key_count) {
        if (!camera_from_key(&job->keys[0], "render.keys[0]", camera, error))
            return false;
        for (int i = 0; i < 3; i++) {
            centre_world[i] = job->keys[0].look_at_world[i];
            axis_world[i] = job->keys[0].up_world[i];
        }
    } else {
        auto_camera(job, scene, camera, centre_world);
    }
    double turns = job->orbit_turn != 0.0f ? time_s / (double)job->orbit_seconds : 0.0;
    if (animation_turn(camera, axis_world, centre_world, (double)job->orbit_turn * turns))
        return true;
    return error_set(error, ERROR_INVALID, "render.keys[0].up_world", "there is no direction to turn about");
}

/* ---- a camera of the scene ---------------------------------------------------------------------- */

/* Unit vector from `v` without its part along `other`; false: nothing is left. */
static bool normalise_without(double v[3], const double *other)
{
    double along = other ? v[0] * other[0] + v[1] * other[1] + v[2] * other[2] : 0.0, length = 0.0;
    for (int i = 0; i < 3; i++) {
        v[i] -= other ? along * other[i] : 0.0;
        length += v[i] * v[i];
    }
    length = sqrt(length);
    if (!(length > 1e-30) || !isfinite(length))
        return false;
    for (int i = 0; i < 3; i++)
        v[i] /= length;
    return true;
}

/* The node's axes without the scales, shears and mirrors that may lie above it. */
static bool make_rigid(float m[12])
{
    double back[3] = {(double)m[2], (double)m[6], (double)m[10]};
    double up[3] = {(double)m[1], (double)m[5], (double)m[9]};
    if (!normalise_without(back, NULL) || !normalise_without(up, NULL) || !normalise_without(up, back))
        return false;
    for (int i = 0; i < 3; i++) {
        int next = (i + 1) % 3, after = (i + 2) % 3;
        m[4 * i] = (float)(up[next] * back[after] - up[after] * back[next]);
        m[4 * i + 1] = (float)up[i];
        m[4 * i + 2] = (float)back[i];
    }
    return true;
}

static bool node_camera(const struct engine_job *job, const struct scene *scene, struct frame_camera *camera,
                        struct error *error)
{
    const char *field = "render.camera_node";
    const struct scene_node *node = scene_node(scene, job->camera_node);
    if (!node)
        return error_set(error, ERROR_UNKNOWN_ID, field, "there is no node %u", job->camera_node);
    const struct scene_camera *shown = node->kind == NODE_CAMERA ? scene_camera(scene, node->object) : NULL;
    if (!shown)
        return error_set(error, ERROR_INVALID, field, "node %u shows no camera", job->camera_node);
    *camera = (struct frame_camera){.fov_y = shown->fov_y, .ortho_height = shown->height, .near = shown->near};
    if (scene_world_from_node(scene, NULL, node->base.id, camera->world_from_view) &&
        make_rigid(camera->world_from_view))
        return true;
    return error_set(error, ERROR_INVALID, field, "the transform of node %u flattens its camera",
                     job->camera_node);
}

/* ---- all paths ---------------------------------------------------------------------------------- */

bool animation_check(const struct engine_job *job, const struct scene *scene, struct error *error)
{
    if (!(job->frames_per_second > 0.0f))
        return error_set(error, ERROR_INVALID, "render.frames_per_second", "%g is not above 0",
                         (double)job->frames_per_second);
    if ((unsigned)job->path > CAMERA_ORBIT)
        return error_set(error, ERROR_INVALID, "render.camera_path", "%u is no camera path", (unsigned)job->path);
    if (job->path == CAMERA_KEYS && !job->key_count)
        return error_set(error, ERROR_INVALID, "render.keys", "the camera path keys needs at least one key");
    for (uint32_t i = 1; i < job->key_count; i++) {
        if (job->keys[i].time_s > job->keys[i - 1].time_s)
            continue;
        char field[48];
        snprintf(field, sizeof field, "render.keys[%u].time_s", i);
        return error_set(error, ERROR_INVALID, field, "%g s is not after the key before it, at %g s",
                         (double)job->keys[i].time_s, (double)job->keys[i - 1].time_s);
    }
    if (job->path == CAMERA_ORBIT && job->orbit_turn != 0.0f && !(job->orbit_seconds > 0.0f))
        return error_set(error, ERROR_INVALID, "render.orbit_seconds", "%g is not above 0",
                         (double)job->orbit_seconds);
    struct frame_camera camera;
    return animation_camera(job, scene, job->first_frame, &camera, error);
}

static bool camera_at(const struct engine_job *job, const struct scene *scene, uint32_t frame,
                      struct frame_camera *camera, struct error *error)
{
    double time_s = animation_time_s(job, frame);
    float centre_world[3];
    struct camera_key key;
    *camera = (struct frame_camera){0};
    switch (job->path) {
    case CAMERA_AUTO:
        auto_camera(job, scene, camera, centre_world);
        return true;
    case CAMERA_NODE:
        return node_camera(job, scene, camera, error);
    case CAMERA_KEYS:
        animation_key_at(job->keys, job->key_count, time_s, &key);
        return camera_from_key(&key, "render.keys", camera, error);
    case CAMERA_ORBIT:
        return orbit_camera(job, scene, time_s, camera, error);
    }
    return error_set(error, ERROR_INVALID, "render.camera_path", "%u is no camera path", (unsigned)job->path);
}

bool animation_camera(const struct engine_job *job, const struct scene *scene, uint32_t frame,
                      struct frame_camera *camera, struct error *error)
{
    if (!(fabs(animation_time_s(job, frame)) <= TIME_MAX_S)) {
        error_set(error, ERROR_INVALID, "render.frames_per_second", "frame %u is at %g s, beyond %g s", frame,
                  animation_time_s(job, frame), TIME_MAX_S);
        return error_remedy(error, "use more frames a second, or smaller frame numbers");
    }
    if (!camera_at(job, scene, frame, camera, error))
        return false;
    for (int i = 0; i < 12; i++) {
        if (fabsf(camera->world_from_view[i]) <= PLACE_MAX) /* false for a NaN too */
            continue;
        error_set(error, ERROR_INVALID, "render.camera_path", "in frame %u the camera is beyond %g m", frame,
                  (double)PLACE_MAX);
        return error_remedy(error, "bring the camera, or what it is to show, nearer to the origin");
    }
    return true;
}
