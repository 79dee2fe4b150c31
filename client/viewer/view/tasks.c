/* SPDX-License-Identifier: MIT */
/* Jobs beside the view: cameras of the scene, picks, focus, and the comparison with the reference. */
#include "tasks.h"
#include "view.h"
#include "protocol/common/clock.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define COMPARED_SAMPLES 4u /* samples per pixel; more would take the reference tracer long */
/* Share of the scene's diagonal; a scene whose middle is nearer to the eye is not orbited */
#define NEAR_SHARE 0.05

uint32_t view_primary(const struct view *view)
{
    if (view->options->has_primary)
        return view->render.tracing.primary;
    return view->settings.tracer == PROTOCOL_TRACER_REFERENCE ? PROTOCOL_PRIMARY_TRACE : PROTOCOL_PRIMARY_RASTER;
}

/* ---- requests ---- */

/* Fills a probe: one ray through a pixel's centre, which returns its hit point. */
static void fill_probe(const struct view *view, struct message_render *job)
{
    *job = view->render;
    job->picture.width = job->picture.height = 1;
    job->sampling.samples = 1;
    job->light.depth = 0;
    job->tracing.tracer = view->settings.tracer;
    job->tracing.settings = view->settings.tracers;
    job->light.integrator = PROTOCOL_INTEGRATOR_WHITTED;
    job->camera.aperture = job->camera.shutter = 0;
    job->picture.layers = 1u << PROTOCOL_LAYER_POSITION;
    job->picture.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
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
    job->camera.camera_path = PROTOCOL_CAMERA_NODE;
    job->camera.camera_node = node;
}

static void use_key(struct message_render *job, struct record_camera_key *key)
{
    job->camera.camera_path = PROTOCOL_CAMERA_KEYS;
    job->keys = key;
    job->keys_count = 1;
}

/* Maps the job's time 0 to the tour's time in the clip. */
static void use_clip(const struct view *view, struct message_render *job, struct record_clip_use *use)
{
    const struct tour *tour = &view->eye.tour;
    const struct fl_clip_info *clip =
        tour->clip != TOUR_NONE ? fl_scene_clip(session_scene(view->session), (size_t)tour->clip) : NULL;
    if (!clip || clip->clip == 0)
        return;
    *use = (struct record_clip_use){.clip = clip->clip, .start_s = -(float)tour->time_s, .speed = 1, .loop = 1};
    job->clips = use;
    job->clips_count = 1;
}

static void aim(const struct view *view, struct record_camera_key *key)
{
    struct viewer_camera camera = view->eye.camera;
    double direction[3];
    struct message_render render = {.picture.width = (uint32_t)view->frames.live.width,
                                    .picture.height = (uint32_t)view->frames.live.height};
    view_use_eyes(view, &render);
    camera_ray(&camera, (double)render.picture.width / render.picture.height, view->tasks.x, view->tasks.y,
               direction);
    const double distance = camera_distance(&camera);
    for (int i = 0; i < 3; i++)
        camera.look_at[i] = camera.eye[i] + direction[i] * distance;
    fill_key(&camera, key);
}

/* Uses the camera of the view. */
static void use_camera(const struct view *view, struct message_render *job, struct record_camera_key *key)
{
    fill_key(&view->eye.camera, key);
    if (view_follows(view))
        use_node(job, view->eye.followed);
    else
        use_key(job, key);
}

/* Fills the job of the reference picture: everything except the tracer as in the view. */
static void fill_reference(const struct view *view, struct message_render *job, struct record_camera_key *key)
{
    *job = view->render;
    job->picture.width = (uint32_t)view->heat.compared.width;
    job->picture.height = (uint32_t)view->heat.compared.height;
    job->sampling.samples = view->frames.last.samples;
    job->tracing.tracer = PROTOCOL_TRACER_REFERENCE;
    job->tracing.primary = view_primary(view);
    job->light.integrator = view->settings.integrator;
    job->picture.tone_map = view->settings.tone_map;
    job->picture.exposure_stops += (float)view->settings.exposure_thirds / 3;
    job->sampling.accumulate = PROTOCOL_ACCUMULATION_ON; /* uses the random numbers of a view */
    view_use_eyes(view, job);
    job->picture.view_source = PROTOCOL_VIEW_SOURCE_RAYS; /* an error of layers must show in the comparison */
    job->encoding = session_is_local(view->session) ? PROTOCOL_ENCODING_RAW : PROTOCOL_ENCODING_PREDICTED;
    use_camera(view, job, key);
}

static void ask_for_ids(struct message_render *job)
{
    job->picture.layers = 1u << PROTOCOL_LAYER_ID;
    job->tracing.tracer = PROTOCOL_TRACER_BVH; /* sampled tracers have no node identifiers */
}

static bool ask(struct view *view, enum view_task task, struct fl_error *refusal)
{
    struct message_render job;
    struct record_camera_key key = {0};
    struct record_clip_use use;
    fill_probe(view, &job);
    switch (task) {
    case TASK_CAMERA:
        use_node(&job, view->tasks.camera_node);
        break;
    case TASK_PICK:
        ask_for_ids(&job);
        aim(view, &key);
        use_key(&job, &key);
        break;
    case TASK_FOCUS:
        aim(view, &key);
        use_key(&job, &key);
        break;
    case TASK_OUTLINE:
        ask_for_ids(&job);
        view_outline_ask(view, &job);
        use_camera(view, &job, &key);
        break;
    case TASK_REFERENCE:
        if (!pixmap_copy(&view->heat.compared, &view->frames.live, refusal))
            return false;
        view->heat.command = view->sent.command;
        view->heat.change = view->sent.change;
        view->heat.revision = view->frames.last.revision;
        fill_reference(view, &job, &key);
        break;
    default:
        break;
    }
    use_clip(view, &job, &use);
    return session_ask(view->session, &job, refusal);
}

/* ---- answers ---- */

/* Reads the hit point of a probe. Returns false on a miss. */
static bool read_hit(const struct fl_frame *frame, double numbers[3])
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

/* Returns the depth of the scene's middle along the view; 0: behind the eye, or a single node is framed. */
static double depth_of_scene(const struct view *view, const struct fl_frame *frame)
{
    struct fl_scene_bounds bounds = {.empty = true};
    struct fl_error ignored;
    double depth = 0, diagonal = 0;
    if (view->render.camera.auto_node != 0 ||
        !fl_scene_get_bounds(session_scene(view->session), &bounds, &ignored) || bounds.empty)
        return 0;
    for (int i = 0; i < 3; i++) {
        const double lower = (double)bounds.lower_world[i], upper = (double)bounds.upper_world[i];
        depth -= (double)frame->world_from_view[i * 4 + 2] * from_eye(frame, i, (lower + upper) / 2);
        diagonal = hypot(diagonal, upper - lower);
    }
    return depth > NEAR_SHARE * diagonal ? depth : 0;
}

/* Returns the distance to orbit at: of the scene's middle, else of the surface in the picture's middle. */
static double distance_from(const struct view *view, const struct fl_frame *frame)
{
    const double depth = depth_of_scene(view, frame);
    double place[3], square = 0;
    if (depth > 0)
        return depth;
    if (!read_hit(frame, place))
        return view->eye.has_camera ? camera_distance(&view->eye.camera) : 1;
    for (int i = 0; i < 3; i++)
        square += pow(from_eye(frame, i, place[i]), 2);
    return square > 0 ? sqrt(square) : 1;
}

static void take_camera(struct view *view, enum view_task task, const struct fl_frame *frame)
{
    struct viewer_camera camera;
    camera_from_frame(&camera, frame, distance_from(view, frame));
    if (task == TASK_HOME) {
        view->eye.home = camera;
        view->eye.has_home = true;
    }
    view_go(view, &camera, task == TASK_HOME ? view_home_node(view) : view->tasks.camera_node);
}

static void take_focus(struct view *view, const struct fl_frame *frame)
{
    double place[3];
    struct viewer_camera camera = view->eye.camera;
    if (!read_hit(frame, place)) {
        screen_say(view->screen, "there is no surface to focus on");
        return;
    }
    camera_focus(&camera, place);
    view_go(view, &camera, 0);
    screen_say(view->screen, "focus: %.4g m away", camera_distance(&camera));
}

static void take_pick(struct view *view, const struct fl_frame *frame)
{
    double numbers[3];
    if (read_hit(frame, numbers))
        view->tasks.picked = (struct view_picked){true, (uint32_t)numbers[0], (uint32_t)numbers[1]};
    else
        screen_say(view->screen, "there is no surface");
}

static void take_reference(struct view *view, struct fl_frame *frame)
{
    const struct pixmap *compared = &view->heat.compared;
    if (!pixmap_resize(&view->heat.map, compared->width, compared->height, &view->failure))
        return;
    struct pixmap reference = {0};
    pixmap_take(&reference, frame); /* over black, like the other picture */
    heat_map(compared->pixels, reference.pixels, (size_t)compared->width * (size_t)compared->height, HEAT_TOP,
             view->heat.map.pixels, &view->heat.figures);
    pixmap_finish(&reference);
    view->heat.is_there = true;
    view->screen->must_draw = true;
}

static void take(struct view *view, struct fl_frame *frame)
{
    const enum view_task task = view->tasks.current;
    view->tasks.current = TASK_NONE;
    if (task == TASK_FOCUS)
        take_focus(view, frame);
    else if (task == TASK_PICK)
        take_pick(view, frame);
    else if (task == TASK_REFERENCE)
        take_reference(view, frame);
    else if (task == TASK_OUTLINE)
        view_outline_take(view, frame);
    else
        take_camera(view, task, frame);
    fl_frame_destroy(frame);
}

static void refuse(struct view *view, enum view_task task, const struct fl_error *refusal)
{
    view->tasks.current = TASK_NONE;
    if (refusal->code == FL_ERROR_NONE) /* the connection is lost */
        return;
    if (task == TASK_OUTLINE) {
        view_outline_refuse(view);
        return;
    }
    screen_say(view->screen, "not possible: %s", refusal->text);
    if (task == TASK_REFERENCE)
        view->heat.is_refused = true;
    if (task == TASK_HOME && !view->eye.has_camera)
        view_refuse_scene(view, refusal);
}

/* ---- which one ---- */

static bool is_compared(const struct view *view)
{
    return view->heat.command == view->sent.command && view->heat.change == view->sent.change &&
           view->heat.revision == view->frames.last.revision;
}

static enum view_task next_task(struct view *view)
{
    const enum view_task wanted = view->tasks.next;
    view->tasks.next = TASK_NONE;
    if (wanted != TASK_NONE)
        return wanted;
    if (view->tasks.current != TASK_NONE)
        return TASK_NONE;
    if (!view->eye.has_home && view->refused[0] == '\0')
        return TASK_HOME;
    if (view->settings.error_map && !view->heat.is_there && !view->heat.is_refused &&
        view_is_at_rest(view, COMPARED_SAMPLES))
        return TASK_REFERENCE;
    return view_outline_is_due(view) ? TASK_OUTLINE : TASK_NONE;
}

void view_step_tasks(struct view *view)
{
    struct fl_error refusal = {0};
    /* Discards an answer for another picture. */
    if (view->tasks.current == TASK_OUTLINE && !view_outline_is_asked(view)) {
        session_give_up(view->session);
        view->tasks.current = TASK_NONE;
    }
    if (!view->settings.error_map || !is_compared(view)) {
        view->screen->must_draw = view->screen->must_draw || view->heat.is_there;
        view->heat.is_there = view->heat.is_refused = false;
        if (view->tasks.current == TASK_REFERENCE) {
            session_give_up(view->session);
            view->tasks.current = TASK_NONE;
        }
    }
    const enum view_task next = next_task(view);
    if (next != TASK_NONE) {
        view->tasks.current = next;
        if (!ask(view, next, &refusal))
            refuse(view, next, &refusal);
    }
    struct fl_frame *frame = session_answer(view->session, &refusal);
    if (frame)
        take(view, frame);
    else if (refusal.code != FL_ERROR_NONE)
        refuse(view, view->tasks.current, &refusal);
}

void view_drop_tasks(struct view *view)
{
    view->tasks.current = TASK_NONE;
    view->heat.is_there = false;
}
