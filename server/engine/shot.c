/* SPDX-License-Identifier: MIT */
#include "engine/shot.h"

#include "engine/ground.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define FOCUS_MAX 1e12f
#define SHUTTER_MAX_S 1e6
#define EXPOSURE_MAX_STOPS 64.0f

/* Seed of a frame: the job's for frame 0, and different noise for each other frame. */
static uint64_t shot_seed(uint64_t job_seed, uint32_t frame)
{
    /* The finaliser of MurmurHash3 (Appleby): one to one, and 0 for 0. */
    uint64_t mixed = frame;
    mixed = (mixed ^ (mixed >> 33)) * 0xff51afd7ed558ccdu;
    mixed = (mixed ^ (mixed >> 33)) * 0xc4ceb9fe1a85ec53u;
    return job_seed ^ mixed ^ (mixed >> 33);
}

void shot_finish(struct shot *shot)
{
    scene_motion_finish(&shot->motion);
}

/* The job's lens, with the values that clips replace. */
static void set_lens(struct frame_request *request, const struct animation_view *view,
                     const struct pose_view *given)
{
    if (given->given & POSE_VIEW_APERTURE)
        request->aperture = given->aperture;
    if (given->given & POSE_VIEW_FOCUS)
        request->focus = given->focus;
    if (given->given & POSE_VIEW_EXPOSURE)
        request->picture.exposure_stops =
            fminf(fmaxf(request->picture.exposure_stops + given->exposure_stops, -EXPOSURE_MAX_STOPS),
                  EXPOSURE_MAX_STOPS);
    if (!(request->focus > 0.0f))
        request->focus = fminf(view->focus, FOCUS_MAX);
    if (!(request->camera.fov_y > 0.0f))
        request->aperture = 0.0f; /* parallel rays go through no lens */
    if (!(request->aperture > 0.0f))
        request->focus = 0.0f;
}

static bool motion_make(struct shot *shot, const struct engine_job *job, const struct scene *scene, double time_s,
                        struct error *error)
{
    struct error local = {0};
    if (!job->clip_count || scene_motion_evaluate(&shot->motion, scene, job->clips, job->clip_count, time_s,
                                                  (double)shot->shutter_s, &local))
        return true;
    char field[sizeof(local.field)];
    snprintf(field, sizeof(field), "render.%.100s", local.field);
    return error_set(error, local.kind, field, "%s", local.text);
}

/* Begins a shot with the shutter and the poses while it is open. */
static bool shot_begin(struct shot *shot, const struct engine_job *job, const struct scene *scene, double time_s,
                       struct error *error)
{
    *shot = (struct shot){.request = job->frame, .time_s = (float)time_s};
    shot->request.aperture = job->camera.aperture;
    shot->request.focus = job->camera.focus;
    shot->shutter_s = (float)fmin((double)job->camera.shutter / (double)job->frames_per_second, SHUTTER_MAX_S);
    return motion_make(shot, job, scene, time_s, error);
}

/* Layers are not used where a picture does not need them: one sharp view from where it is rendered. */
static void set_source(struct frame_request *request)
{
    if (!frame_has_views(request) && !(request->aperture > 0.0f) && !request->has_key)
        request->picture.view_source = VIEW_SOURCE_RAYS;
}

static bool check_time(uint32_t frame, double time_s, struct error *error)
{
    if (fabs(time_s) <= ANIMATION_TIME_MAX_S)
        return true;
    error_set(error, ERROR_INVALID, "render.frames_per_second", "frame %u is at %g s, beyond %g s", frame, time_s,
              ANIMATION_TIME_MAX_S);
    return error_remedy(error, "use more frames a second, or smaller frame numbers");
}

/* Camera at a neighbouring time; where there is none, it stays where it is. */
static void neighbour_camera(const struct engine_job *job, const struct scene *scene,
                             const struct scene_pose *pose, double time_s, struct animation_bounds *bounds,
                             struct frame_camera *camera)
{
    struct animation_view view;
    struct error none = {0};
    if (animation_view(job, scene, pose, time_s, bounds, &view, &none))
        *camera = view.camera;
}

/* Adds poses and cameras of a frame earlier and a frame later. The first frame has one before it too, and the last
 * one after it: motion vectors continue where motions do. */
static bool add_neighbours(struct shot *shot, const struct engine_job *job, const struct scene *scene,
                           double time_s, struct animation_bounds *bounds, struct error *error)
{
    struct frame_request *request = &shot->request;
    struct scene_motion *motion = &shot->motion;
    const double step_s = 1.0 / (double)job->frames_per_second, times_s[2] = {time_s - step_s, time_s + step_s};
    if (!(request->picture.layers & 1u << LAYER_MOTION))
        return true;
    if (job->clip_count &&
        !scene_motion_add_neighbours(motion, scene, job->clips, job->clip_count, times_s, error))
        return false;
    request->has_neighbours = true;
    request->clips_time_s = job->clip_count ? time_s : 0.0;
    request->camera_earlier = request->camera_later = request->camera;
    neighbour_camera(job, scene, job->clip_count ? &motion->earlier : NULL, times_s[0], bounds,
                     &request->camera_earlier);
    neighbour_camera(job, scene, job->clip_count ? &motion->later : NULL, times_s[1], bounds,
                     &request->camera_later);
    return true;
}

/* A frame without a key frame for its layers. */
static bool make_alone(struct shot *shot, const struct engine_job *job, const struct scene *scene, uint32_t frame,
                       struct animation_bounds *bounds, struct error *error)
{
    static const struct pose_view nothing = {0};
    double time_s = animation_time_s(job, frame);
    if (!check_time(frame, time_s, error) || !shot_begin(shot, job, scene, time_s, error))
        return false;
    const struct scene_pose *pose = shot->motion.pose_count ? &shot->motion.poses[0] : NULL;
    struct animation_view view;
    if (!animation_view(job, scene, pose, time_s, bounds, &view, error) ||
        !ground_place(job, scene, bounds, &shot->request.ground, error)) {
        shot_finish(shot);
        return false;
    }
    shot->request.camera = view.camera;
    if (!add_neighbours(shot, job, scene, time_s, bounds, error)) {
        shot_finish(shot);
        return false;
    }
    set_lens(&shot->request, &view, pose ? &pose->view : &nothing);
    set_source(&shot->request);
    shot->request.starts_anew &= frame == job->first_frame;
    if (!shot->request.sampling.accumulate)
        shot->request.sampling.seed = shot_seed(job->frame.sampling.seed, frame);
    return true;
}

uint32_t shot_key_frame(const struct engine_job *job, uint32_t frame)
{
    const int64_t every = job->frame.picture.upsample > 1 ? job->frame.picture.upsample : 1,
                  origin = job->time_origin_frame;
    const int64_t below = (((int64_t)frame - origin) % every + every) % every; /* distance to the key before */
    const bool is_next = 2 * below > every || below > (int64_t)frame;          /* there is no frame below 0 */
    return (uint32_t)((int64_t)frame - below + (is_next ? every : 0));
}

bool shot_make(struct shot *shot, const struct engine_job *job, const struct scene *scene, uint32_t frame,
               struct animation_bounds *bounds, struct error *error)
{
    struct shot own;
    const uint32_t key = shot_key_frame(job, frame);
    if (key == frame && job->frame.picture.upsample <= 1)
        return make_alone(shot, job, scene, frame, bounds, error);
    /* The camera and its lens are the frame's own; poses, shutter and noise are those of the key. The key itself
     * is made in this way, too: its layers are rendered for the others anyway, and look like it. */
    if (!make_alone(&own, job, scene, frame, bounds, error))
        return false;
    shot_finish(&own);
    if (!make_alone(shot, job, scene, key, bounds, error))
        return false;
    const uint64_t seed = shot->request.sampling.seed;
    const struct frame_camera key_camera = shot->request.camera;
    shot->request = own.request;
    shot->request.sampling.seed = seed;
    shot->request.has_key = true;
    shot->request.key_camera = key_camera;
    shot->request.picture.view_source = job->frame.picture.view_source;
    shot->time_s = own.time_s;
    return true;
}

/* The client's key sets the view's camera, whatever the clips say of the job's camera. */
static bool view_from_key(const struct record_camera_key *key, struct animation_view *view, struct error *error)
{
    if (!animation_key_camera(key, "view_camera.up_world", &view->camera, error))
        return false;
    view->focus = animation_distance(&view->camera, key->look_at_world);
    return true;
}

/* Camera of that node at that time, as a job along the path `node` would have it. */
static bool view_from_node(const struct engine_job *job, const struct scene *scene, const struct scene_pose *pose,
                           const struct view_camera *from, struct animation_bounds *bounds,
                           struct animation_view *view, struct error *error)
{
    struct engine_job along = *job;
    along.camera.camera_path = CAMERA_NODE;
    along.camera.camera_node = from->node;
    struct error local = {0};
    if (animation_view(&along, scene, pose, (double)from->key.time_s, bounds, view, &local))
        return true;
    return error_set(error, local.kind, "view_camera.node", "%s", local.text);
}

bool shot_make_at(struct shot *shot, const struct engine_job *job, const struct scene *scene,
                  const struct view_camera *from, struct animation_bounds *bounds, struct error *error)
{
    static const struct pose_view nothing = {0};
    if (!shot_begin(shot, job, scene, (double)from->key.time_s, error))
        return false;
    const struct scene_pose *pose = shot->motion.pose_count ? &shot->motion.poses[0] : NULL;
    struct animation_view view = {0};
    if (!(from->node ? view_from_node(job, scene, pose, from, bounds, &view, error)
                     : view_from_key(&from->key, &view, error)) ||
        !ground_place(job, scene, bounds, &shot->request.ground, error)) {
        shot_finish(shot);
        return false;
    }
    shot->request.camera = view.camera;
    set_lens(&shot->request, &view, pose ? &pose->view : &nothing);
    set_source(&shot->request);
    return true;
}

bool shot_check(const struct engine_job *job, const struct scene *scene, struct animation_bounds *bounds,
                struct error *error)
{
    struct shot shot;
    if (!animation_check(job, error) || !shot_make(&shot, job, scene, job->first_frame, bounds, error))
        return false;
    shot_finish(&shot);
    return true;
}
