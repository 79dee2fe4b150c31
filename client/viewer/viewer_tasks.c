/* SPDX-License-Identifier: MIT */
/* Jobs beside the view: the scene's cameras, the point under the pointer, the comparison with the reference. */
#include "viewer/viewer_state.h"
#include "protocol/common/clock.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define COMPARED_SAMPLES 4u /* of a pixel: the reference may take long */
#define NEAR_SHARE 0.05     /* of the scene's diagonal: nearer to the eye its middle is nothing to turn about */

uint32_t viewer_primary(const struct viewer *viewer)
{
    if (viewer->options->has_primary)
        return viewer->view.primary;
    return viewer->settings.tracer == PROTOCOL_TRACER_REFERENCE ? PROTOCOL_PRIMARY_TRACE : PROTOCOL_PRIMARY_RASTER;
}

bool viewer_follows(const struct viewer *viewer)
{
    return viewer->followed != 0 && viewer->tour.clip != TOUR_NONE && viewer->glide_begin_ns == 0;
}

uint32_t viewer_home_node(const struct viewer *viewer)
{
    return viewer->view.camera_path == PROTOCOL_CAMERA_NODE ? viewer->view.camera_node : 0;
}

void viewer_go(struct viewer *viewer, const struct viewer_camera *camera, uint32_t node)
{
    viewer->followed = node;
    if (!viewer->has_camera || viewer->options->replay) {
        viewer->camera = *camera;
        viewer->glide_begin_ns = 0;
        viewer->motion = (struct plan_motion){0}; /* a jump has no velocity */
    } else {
        viewer->glide_from = viewer->camera;
        viewer->glide_to = *camera;
        viewer->glide_begin_ns = monotonic_now_ns();
    }
    viewer->has_camera = true;
    viewer->must_look = true;
    viewer->moved_ns = monotonic_now_ns();
}

/* ---- asking ---- */

/* One ray through the centre of one pixel, which returns its hit point. */
static void fill_probe(const struct viewer *viewer, struct message_render *job)
{
    *job = viewer->view;
    job->width = job->height = 1;
    job->samples = 1;
    job->depth = 0;
    job->tracer = viewer->settings.tracer;
    job->settings = viewer->settings.tracers;
    job->integrator = PROTOCOL_INTEGRATOR_WHITTED;
    job->aperture = job->shutter = 0;
    job->layers = 1u << PROTOCOL_LAYER_POSITION;
    job->format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    job->encoding = PROTOCOL_ENCODING_RAW;
}

static void fill_key(const struct viewer_camera *camera, struct record_camera_key *key)
{
    struct fl_view_camera out;
    camera_export(camera, &out);
    memcpy(key->eye_world, out.eye_world, sizeof(key->eye_world));
    memcpy(key->look_at_world, out.look_at_world, sizeof(key->look_at_world));
    memcpy(key->up_world, out.up_world, sizeof(key->up_world));
    key->fov_y = out.fov_y;
}

static void use_node(struct message_render *job, uint32_t node)
{
    job->camera_path = PROTOCOL_CAMERA_NODE;
    job->camera_node = node;
}

static void use_key(struct message_render *job, struct record_camera_key *key)
{
    job->camera_path = PROTOCOL_CAMERA_KEYS;
    job->keys = key;
    job->keys_count = 1;
}

/* The frame at the job's time 0 is that at the tour's time. */
static void use_clip(const struct viewer *viewer, struct message_render *job, struct record_clip_use *use)
{
    const struct tour *tour = &viewer->tour;
    const struct fl_clip_info *clip =
        tour->clip != TOUR_NONE ? fl_scene_clip(session_scene(viewer->session), (size_t)tour->clip) : NULL;
    if (!clip || clip->clip == 0)
        return;
    *use = (struct record_clip_use){.clip = clip->clip, .start_s = -(float)tour->time_s, .speed = 1, .loop = 1};
    job->clips = use;
    job->clips_count = 1;
}

static void aim(const struct viewer *viewer, struct record_camera_key *key)
{
    struct viewer_camera camera = viewer->camera;
    double direction[3];
    struct message_render view = {.width = (uint32_t)viewer->live.width, .height = (uint32_t)viewer->live.height};
    viewer_use_eyes(viewer, &view);
    camera_ray(&camera, (double)view.width / view.height, viewer->focus_x, viewer->focus_y, direction);
    const double distance = camera_distance(&camera);
    for (int i = 0; i < 3; i++)
        camera.look_at[i] = camera.eye[i] + direction[i] * distance;
    fill_key(&camera, key);
}

/* That of the view. */
static void use_camera(const struct viewer *viewer, struct message_render *job, struct record_camera_key *key)
{
    fill_key(&viewer->camera, key);
    if (viewer_follows(viewer))
        use_node(job, viewer->followed);
    else
        use_key(job, key);
}

/* All but the tracer as in the view. */
static void fill_reference(const struct viewer *viewer, struct message_render *job, struct record_camera_key *key)
{
    *job = viewer->view;
    job->width = (uint32_t)viewer->compared.width;
    job->height = (uint32_t)viewer->compared.height;
    job->samples = viewer->frame.samples;
    job->tracer = PROTOCOL_TRACER_REFERENCE;
    job->primary = viewer_primary(viewer);
    job->integrator = viewer->settings.integrator;
    job->tone_map = viewer->settings.tone_map;
    job->exposure_stops += (float)viewer->settings.exposure_thirds / 3;
    job->accumulate = PROTOCOL_ACCUMULATION_ON; /* with the random numbers of a view */
    viewer_use_eyes(viewer, job);
    job->view_source = PROTOCOL_VIEW_SOURCE_RAYS; /* what layers lack is an error, too */
    job->encoding = session_is_local(viewer->session) ? PROTOCOL_ENCODING_RAW : PROTOCOL_ENCODING_PREDICTED;
    use_camera(viewer, job, key);
}

static void ask_for_ids(struct message_render *job)
{
    job->layers = 1u << PROTOCOL_LAYER_ID;
    job->tracer = PROTOCOL_TRACER_BVH; /* sampled tracers do not know nodes */
}

static bool ask(struct viewer *viewer, enum viewer_task task, struct fl_error *refusal)
{
    struct message_render job;
    struct record_camera_key key = {0};
    struct record_clip_use use;
    fill_probe(viewer, &job);
    switch (task) {
    case TASK_CAMERA:
        use_node(&job, viewer->camera_node);
        break;
    case TASK_PICK:
        ask_for_ids(&job);
        aim(viewer, &key);
        use_key(&job, &key);
        break;
    case TASK_FOCUS:
        aim(viewer, &key);
        use_key(&job, &key);
        break;
    case TASK_OUTLINE:
        ask_for_ids(&job);
        viewer_outline_ask(viewer, &job);
        use_camera(viewer, &job, &key);
        break;
    case TASK_REFERENCE:
        if (!pixmap_copy(&viewer->compared, &viewer->live, refusal))
            return false;
        viewer->heat_command = viewer->command;
        viewer->heat_change = viewer->change;
        viewer->heat_revision = viewer->frame.revision;
        fill_reference(viewer, &job, &key);
        break;
    default:
        break;
    }
    use_clip(viewer, &job, &use);
    return session_ask(viewer->session, &job, refusal);
}

/* ---- answers ---- */

/* Three numbers of what the ray met; false: nothing. */
static bool met(const struct fl_frame *frame, double numbers[3])
{
    float values[4];
    memcpy(values, frame->pixels, sizeof(values));
    for (int i = 0; i < 3; i++)
        numbers[i] = (double)values[i];
    return values[3] > 0;
}

static double from_eye(const struct fl_frame *frame, int axis, double place)
{
    return place - (double)frame->world_from_view[axis * 4 + 3];
}

/* Along the view, to the middle of the scene; 0: it is not in front of the eye, or one node of it is framed. */
static double depth_of_scene(const struct viewer *viewer, const struct fl_frame *frame)
{
    struct fl_scene_bounds bounds = {.empty = true};
    struct fl_error ignored;
    double depth = 0, diagonal = 0;
    if (viewer->view.auto_node != 0 || !fl_scene_get_bounds(session_scene(viewer->session), &bounds, &ignored) ||
        bounds.empty)
        return 0;
    for (int i = 0; i < 3; i++) {
        const double lower = (double)bounds.lower_world[i], upper = (double)bounds.upper_world[i];
        depth -= (double)frame->world_from_view[i * 4 + 2] * from_eye(frame, i, (lower + upper) / 2);
        diagonal = hypot(diagonal, upper - lower);
    }
    return depth > NEAR_SHARE * diagonal ? depth : 0;
}

/* The distance of what the view turns about: the middle of the scene, else the surface in the middle of the
 * picture.
 */
static double distance_from(const struct viewer *viewer, const struct fl_frame *frame)
{
    const double depth = depth_of_scene(viewer, frame);
    double place[3], square = 0;
    if (depth > 0)
        return depth;
    if (!met(frame, place))
        return viewer->has_camera ? camera_distance(&viewer->camera) : 1;
    for (int i = 0; i < 3; i++)
        square += pow(from_eye(frame, i, place[i]), 2);
    return square > 0 ? sqrt(square) : 1;
}

static void take_camera(struct viewer *viewer, enum viewer_task task, const struct fl_frame *frame)
{
    struct viewer_camera camera;
    camera_from_frame(&camera, frame, distance_from(viewer, frame));
    if (task == TASK_HOME) {
        viewer->home = camera;
        viewer->has_home = true;
    }
    viewer_go(viewer, &camera, task == TASK_HOME ? viewer_home_node(viewer) : viewer->camera_node);
}

static void take_focus(struct viewer *viewer, const struct fl_frame *frame)
{
    double place[3];
    struct viewer_camera camera = viewer->camera;
    if (!met(frame, place)) {
        viewer_say(viewer, "there is no surface to focus on");
        return;
    }
    camera_focus(&camera, place);
    viewer_go(viewer, &camera, 0);
    viewer_say(viewer, "focus: %.4g m away", camera_distance(&camera));
}

static void take_pick(struct viewer *viewer, const struct fl_frame *frame)
{
    double numbers[3];
    if (met(frame, numbers))
        viewer_edit_object(viewer, (uint32_t)numbers[0], (uint32_t)numbers[1]);
    else
        viewer_say(viewer, "there is no surface");
}

static void take_reference(struct viewer *viewer, struct fl_frame *frame)
{
    const struct pixmap *compared = &viewer->compared;
    if (!pixmap_resize(&viewer->heat, compared->width, compared->height, &viewer->failure))
        return;
    struct pixmap reference = {0};
    pixmap_take(&reference, frame); /* over black, as the other */
    heat_map(compared->pixels, reference.pixels, (size_t)compared->width * (size_t)compared->height, HEAT_TOP,
             viewer->heat.pixels, &viewer->heat_figures);
    pixmap_finish(&reference);
    viewer->has_heat = true;
    viewer->must_draw = true;
}

static void take(struct viewer *viewer, struct fl_frame *frame)
{
    const enum viewer_task task = viewer->task;
    viewer->task = TASK_NONE;
    if (task == TASK_FOCUS)
        take_focus(viewer, frame);
    else if (task == TASK_PICK)
        take_pick(viewer, frame);
    else if (task == TASK_REFERENCE)
        take_reference(viewer, frame);
    else if (task == TASK_OUTLINE)
        viewer_outline_take(viewer, frame);
    else
        take_camera(viewer, task, frame);
    fl_frame_destroy(frame);
}

static void refuse(struct viewer *viewer, enum viewer_task task, const struct fl_error *refusal)
{
    viewer->task = TASK_NONE;
    if (refusal->code == FL_ERROR_NONE) /* the connection is lost */
        return;
    if (task == TASK_OUTLINE) {
        viewer_outline_refuse(viewer);
        return;
    }
    viewer_say(viewer, "not possible: %s", refusal->text);
    if (task == TASK_REFERENCE)
        viewer->heat_refused = true;
    if (task == TASK_HOME && !viewer->has_camera)
        viewer_refuse_scene(viewer, refusal);
}

/* ---- which one ---- */

static bool is_compared(const struct viewer *viewer)
{
    return viewer->heat_command == viewer->command && viewer->heat_change == viewer->change &&
           viewer->heat_revision == viewer->frame.revision;
}

static enum viewer_task next_task(struct viewer *viewer)
{
    const enum viewer_task wanted = viewer->wanted;
    viewer->wanted = TASK_NONE;
    if (wanted != TASK_NONE)
        return wanted;
    if (viewer->task != TASK_NONE)
        return TASK_NONE;
    if (!viewer->has_home && viewer->refused[0] == '\0')
        return TASK_HOME;
    if (viewer->settings.error_map && !viewer->has_heat && !viewer->heat_refused &&
        viewer_is_at_rest(viewer, COMPARED_SAMPLES))
        return TASK_REFERENCE;
    return viewer_outline_is_due(viewer) ? TASK_OUTLINE : TASK_NONE;
}

void viewer_step_tasks(struct viewer *viewer)
{
    struct fl_error refusal = {0};
    /* An answer for another picture is discarded. */
    if (viewer->task == TASK_OUTLINE && !viewer_outline_is_asked(viewer)) {
        session_give_up(viewer->session);
        viewer->task = TASK_NONE;
    }
    if (!viewer->settings.error_map || !is_compared(viewer)) {
        viewer->must_draw = viewer->must_draw || viewer->has_heat;
        viewer->has_heat = viewer->heat_refused = false;
        if (viewer->task == TASK_REFERENCE) {
            session_give_up(viewer->session);
            viewer->task = TASK_NONE;
        }
    }
    const enum viewer_task next = next_task(viewer);
    if (next != TASK_NONE) {
        viewer->task = next;
        if (!ask(viewer, next, &refusal))
            refuse(viewer, next, &refusal);
    }
    struct fl_frame *frame = session_answer(viewer->session, &refusal);
    if (frame)
        take(viewer, frame);
    else if (refusal.code != FL_ERROR_NONE)
        refuse(viewer, viewer->task, &refusal);
}

void viewer_drop_tasks(struct viewer *viewer)
{
    viewer->task = TASK_NONE;
    viewer->has_heat = false;
}
