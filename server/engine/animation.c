/* SPDX-License-Identifier: MIT */
#include "engine/animation.h"

#include "scene/curve.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

/* The protocol's range of a key; a spline through keys near its ends may leave it. */
#define FOV_MIN 0.001f
#define FOV_MAX 3.1f
/* The protocol's range of a frame's camera; composed transforms and splines may leave it. */
#define PLACE_MAX 1e12f
#define DEGREE 0.017453293f /* radians */

double animation_time_s(const struct engine_job *job, uint32_t frame)
{
    return ((double)frame - (double)job->time_origin_frame) / (double)job->frames_per_second;
}

/* ---- keys --------------------------------------------------------------------------------------- */

/* A key's numbers lie behind its time, without gaps. */
#define KEY_FLOATS (sizeof(struct record_camera_key) / sizeof(float))
_Static_assert(offsetof(struct record_camera_key, eye_world) == sizeof(float) &&
                   offsetof(struct record_camera_key, fov_y) == (KEY_FLOATS - 1) * sizeof(float),
               "a curve goes through the numbers of a key as through an array");

void animation_key_at(const struct record_camera_key *keys, uint32_t key_count, double time_s,
                      struct record_camera_key *key)
{
    const struct curve curve = {
        .times = &keys[0].time_s,
        .values = keys[0].eye_world,
        .time_stride = KEY_FLOATS,
        .key_stride = KEY_FLOATS,
        .key_count = key_count,
        .width = KEY_FLOATS - 1,
        .interpolation = INTERPOLATION_CATMULL_ROM,
    };
    double value[KEY_FLOATS - 1];
    curve_at(&curve, time_s, value);
    float numbers[KEY_FLOATS] = {(float)time_s};
    for (size_t i = 0; i < KEY_FLOATS - 1; i++)
        numbers[i + 1] = (float)value[i];
    memcpy(key, numbers, sizeof(numbers));
    key->fov_y = fminf(fmaxf(key->fov_y, FOV_MIN), FOV_MAX);
}

bool animation_key_camera(const struct record_camera_key *key, const char *field, struct frame_camera *camera,
                          struct error *error)
{
    if (frame_camera_look_at(camera, key->eye_world, key->look_at_world, key->up_world, key->fov_y))
        return true;
    error_set(error, ERROR_INVALID, field, "at %g s the camera's eye, look-at point and up direction span no view",
              (double)key->time_s);
    return error_remedy(error, "eye and look_at must differ, and up must not be parallel to the view");
}

/* ---- orbit -------------------------------------------------------------------------------------- */

/* Turns a camera about an axis through a point, counterclockwise seen against the axis; false: the axis is 0. */
static bool animation_turn(struct frame_camera *camera, const float axis_world[3], const float centre_world[3],
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

static struct frame_framing framing_of(const struct record_shot *camera)
{
    return (struct frame_framing){
        .azimuth = camera->auto_azimuth * DEGREE,
        .elevation = camera->auto_elevation * DEGREE,
        .fov_y = camera->auto_fov * DEGREE,
        .margin = camera->auto_margin,
        .zoom = camera->auto_zoom,
    };
}

/* Bounds of the whole scene, or of the framed node, at the job's time 0. */
static bool find_bounds(const struct engine_job *job, const struct scene *scene, struct animation_bounds *bounds,
                        struct error *error)
{
    if (job->camera.auto_node && !scene_node(scene, job->camera.auto_node))
        return error_set(error, ERROR_UNKNOWN_ID, "render.auto_node", "node %u does not exist",
                         job->camera.auto_node);
    if (bounds->known && bounds->revision == scene->revision)
        return true;
    struct scene_pose pose;
    if (!scene_pose_evaluate(&pose, scene, job->clips, job->clip_count, 0.0, error))
        return false;
    *bounds = (struct animation_bounds){.known = true, .revision = scene->revision};
    bool any = scene_bounds_below(scene, &pose, job->camera.auto_node, bounds->lower, bounds->upper);
    scene_pose_finish(&pose);
    if (!any && job->camera.auto_node) {
        bounds->known = false;
        error_set(error, ERROR_INVALID, "render.auto_node", "nothing of node %u and what is below it is visible",
                  job->camera.auto_node);
        return error_remedy(error, "frame a node that shows a mesh or spheres, or one above it");
    }
    for (int axis = 0; axis < 3 && !any; axis++) {
        /* Nothing but the environment to see: any place will do. */
        bounds->lower[axis] = -1.0f;
        bounds->upper[axis] = 1.0f;
    }
    return true;
}

static void middle(const struct animation_bounds *bounds, float centre_world[3])
{
    for (int axis = 0; axis < 3; axis++)
        centre_world[axis] = (float)(((double)bounds->lower[axis] + (double)bounds->upper[axis]) / 2);
}

float animation_distance(const struct frame_camera *camera, const float point_world[3])
{
    const float *m = camera->world_from_view;
    double distance = 0.0;
    for (int row = 0; row < 3; row++)
        distance -= ((double)point_world[row] - (double)m[4 * row + 3]) * (double)m[4 * row + 2];
    return distance > 0.0 ? (float)fmin(distance, (double)PLACE_MAX) : 0.0f;
}

/* Extent of the vertices, as round models leave the corners of their bounds empty. False: nothing is visible.
 * Needs find_bounds() first. */
static bool find_reach(const struct engine_job *job, const struct scene *scene, float aspect,
                       struct animation_bounds *bounds)
{
    double directions[FRAME_CAMERA_DIRECTIONS][3];
    float centre[3];
    struct scene_pose pose;
    _Static_assert(FRAME_CAMERA_DIRECTIONS <= SCENE_SUPPORTS_MAX, "all at once");
    const struct frame_framing framing = framing_of(&job->camera);
    frame_camera_directions(directions, &framing, aspect);
    if (bounds->reach_known && memcmp(bounds->directions, directions, sizeof(directions)) == 0)
        return true;
    if (!scene_pose_evaluate(&pose, scene, job->clips, job->clip_count, 0.0, NULL))
        return false;
    memcpy(bounds->directions, directions, sizeof(directions));
    middle(bounds, centre);
    const double axis[2] = {(double)centre[0], (double)centre[2]};
    bounds->reach_known = scene_supports_below(scene, &pose, job->camera.auto_node,
                                               job->camera.camera_path == CAMERA_ORBIT ? axis : NULL, directions,
                                               bounds->supports, FRAME_CAMERA_DIRECTIONS);
    scene_pose_finish(&pose);
    return bounds->reach_known;
}

static bool auto_camera(const struct engine_job *job, const struct scene *scene, struct animation_bounds *bounds,
                        struct frame_camera *camera, struct error *error)
{
    if (!find_bounds(job, scene, bounds, error))
        return false;
    uint32_t width, height;
    frame_view_size(&job->frame, &width, &height);
    const float aspect = (float)width / (float)height;
    const struct frame_framing framing = framing_of(&job->camera);
    double size = 0.0;
    if (!find_reach(job, scene, aspect, bounds)) {
        frame_camera_auto(camera, &framing, bounds->lower, bounds->upper, aspect);
        return true;
    }
    for (int axis = 0; axis < 3; axis++)
        size += fabs((double)bounds->upper[axis] - (double)bounds->lower[axis]);
    frame_camera_around(camera, &framing, aspect, bounds->supports, size);
    return true;
}

static bool orbit_camera(const struct engine_job *job, const struct scene *scene, double time_s,
                         struct animation_bounds *bounds, struct frame_camera *camera, struct error *error)
{
    float centre_world[3], axis_world[3] = {0.0f, 1.0f, 0.0f};
    if (job->key_count) {
        if (!animation_key_camera(&job->keys[0], "render.keys[0]", camera, error))
            return false;
        for (int i = 0; i < 3; i++) {
            centre_world[i] = job->keys[0].look_at_world[i];
            axis_world[i] = job->keys[0].up_world[i];
        }
    } else {
        if (!auto_camera(job, scene, bounds, camera, error))
            return false;
        middle(bounds, centre_world);
    }
    double turns = job->camera.orbit_turn != 0.0f ? time_s / (double)job->camera.orbit_seconds : 0.0;
    if (animation_turn(camera, axis_world, centre_world, (double)job->camera.orbit_turn * turns))
        return true;
    return error_set(error, ERROR_INVALID, "render.keys[0].up_world", "the orbit has no axis: up is zero");
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

static bool node_camera(const struct engine_job *job, const struct scene *scene, const struct scene_pose *pose,
                        struct frame_camera *camera, struct error *error)
{
    const char *field = "render.camera_node";
    const struct scene_node *node = scene_node(scene, job->camera.camera_node);
    if (!node)
        return error_set(error, ERROR_UNKNOWN_ID, field, "node %u does not exist", job->camera.camera_node);
    const struct scene_camera *shown =
        node->value.kind == NODE_CAMERA ? scene_camera(scene, node->value.object) : NULL;
    if (!shown)
        return error_set(error, ERROR_INVALID, field, "node %u shows no camera", job->camera.camera_node);
    *camera = (struct frame_camera){
        .fov_y = shown->value.fov_y, .ortho_height = shown->value.height, .near = shown->value.near};
    if (scene_world_from_node(scene, pose, node->base.id, camera->world_from_view) &&
        make_rigid(camera->world_from_view))
        return true;
    return error_set(error, ERROR_INVALID, field, "the transform of node %u flattens its camera",
                     job->camera.camera_node);
}

/* ---- all paths ---------------------------------------------------------------------------------- */

bool animation_check(const struct engine_job *job, struct error *error)
{
    if (!(job->frames_per_second > 0.0f))
        return error_set(error, ERROR_INVALID, "render.frames_per_second", "%g is not above 0",
                         (double)job->frames_per_second);
    if ((unsigned)job->camera.camera_path > CAMERA_ORBIT)
        return error_set(error, ERROR_INVALID, "render.camera_path", "%u is no camera path",
                         (unsigned)job->camera.camera_path);
    if (job->camera.camera_path == CAMERA_KEYS && !job->key_count)
        return error_set(error, ERROR_INVALID, "render.keys", "the camera path keys needs at least one key");
    for (uint32_t i = 1; i < job->key_count; i++) {
        if (job->keys[i].time_s > job->keys[i - 1].time_s)
            continue;
        char field[48];
        snprintf(field, sizeof(field), "render.keys[%u].time_s", i);
        return error_set(error, ERROR_INVALID, field, "%g s is not after the key before it, at %g s",
                         (double)job->keys[i].time_s, (double)job->keys[i - 1].time_s);
    }
    if (job->camera.camera_path == CAMERA_ORBIT && job->camera.orbit_turn != 0.0f &&
        !(job->camera.orbit_seconds > 0.0f))
        return error_set(error, ERROR_INVALID, "render.orbit_seconds", "%g is not above 0",
                         (double)job->camera.orbit_seconds);
    return true;
}

/* Camera of the path's key at that time, in which clips may replace values. */
static bool keys_camera(const struct engine_job *job, const struct pose_view *given, double time_s,
                        struct frame_camera *camera, float *focus, struct error *error)
{
    struct record_camera_key key;
    animation_key_at(job->keys, job->key_count, time_s, &key);
    if (given->given & POSE_VIEW_EYE)
        memcpy(key.eye_world, given->eye_world, sizeof(key.eye_world));
    if (given->given & POSE_VIEW_LOOK_AT)
        memcpy(key.look_at_world, given->look_at_world, sizeof(key.look_at_world));
    if (given->given & POSE_VIEW_UP)
        memcpy(key.up_world, given->up_world, sizeof(key.up_world));
    if (!animation_key_camera(&key, "render.keys", camera, error))
        return false;
    *focus = animation_distance(camera, key.look_at_world);
    return true;
}

static bool path_allows(const struct engine_job *job, const struct pose_view *given, struct error *error)
{
    if (job->camera.camera_path == CAMERA_KEYS ||
        !(given->given & (POSE_VIEW_EYE | POSE_VIEW_LOOK_AT | POSE_VIEW_UP)))
        return true;
    error_set(error, ERROR_INVALID, "render.camera_path",
              "a clip moves the view's eye, look_at or up, which this camera path does not have");
    return error_remedy(error, "use the camera path keys with one key, or leave that clip out");
}

static bool camera_at(const struct engine_job *job, const struct scene *scene, const struct scene_pose *pose,
                      double time_s, struct animation_bounds *bounds, struct animation_view *view,
                      struct error *error)
{
    static const struct pose_view nothing = {0};
    const struct pose_view *given = pose ? &pose->view : &nothing;
    struct frame_camera *camera = &view->camera;
    float centre_world[3];
    if (!path_allows(job, given, error))
        return false;
    switch (job->camera.camera_path) {
    case CAMERA_KEYS:
        return keys_camera(job, given, time_s, camera, &view->focus, error);
    case CAMERA_AUTO:
        if (!auto_camera(job, scene, bounds, camera, error))
            return false;
        break;
    case CAMERA_NODE:
        if (!node_camera(job, scene, pose, camera, error))
            return false;
        break;
    case CAMERA_ORBIT:
        if (!orbit_camera(job, scene, time_s, bounds, camera, error))
            return false;
        break;
    default:
        return error_set(error, ERROR_INVALID, "render.camera_path", "%u is no camera path",
                         (unsigned)job->camera.camera_path);
    }
    if (job->camera.camera_path == CAMERA_ORBIT && job->key_count) {
        view->focus = animation_distance(camera, job->keys[0].look_at_world);
        return true;
    }
    /* The bounds cost something: only a lens asks for them. */
    if (!(job->camera.aperture > 0.0f) && !(given->given & POSE_VIEW_APERTURE))
        return true;
    if (!find_bounds(job, scene, bounds, error))
        return false;
    middle(bounds, centre_world);
    view->focus = animation_distance(camera, centre_world);
    return true;
}

bool animation_view(const struct engine_job *job, const struct scene *scene, const struct scene_pose *pose,
                    double time_s, struct animation_bounds *bounds, struct animation_view *view,
                    struct error *error)
{
    struct animation_bounds own = {0};
    *view = (struct animation_view){0};
    if (!camera_at(job, scene, pose, time_s, bounds ? bounds : &own, view, error))
        return false;
    struct frame_camera *camera = &view->camera;
    if (pose && (pose->view.given & POSE_VIEW_FOV_Y) && camera->fov_y > 0.0f)
        camera->fov_y = pose->view.fov_y;
    for (int i = 0; i < 12; i++) {
        if (fabsf(camera->world_from_view[i]) <= PLACE_MAX) /* false for a NaN too */
            continue;
        error_set(error, ERROR_INVALID, "render.camera_path", "at %g s the camera is beyond %g m", time_s,
                  (double)PLACE_MAX);
        return error_remedy(error, "move the camera and its target nearer to the origin");
    }
    return true;
}
