/* SPDX-License-Identifier: MIT */
/* Handles events of the user or a replay. */
#include "viewer/viewer_state.h"
#include "protocol/common/clock.h"

#include <stdio.h>
#include <string.h>

#define STEP_S (1.0 / 24) /* of a clip, by key */

/* ---- keys ---- */

void viewer_choose_clip(struct viewer *viewer, int clip)
{
    const struct fl_clip_info *info =
        clip != TOUR_NONE ? fl_scene_clip(session_scene(viewer->session), (size_t)clip) : NULL;
    tour_set_duration(&viewer->tour, info ? (double)info->duration_s : 0);
    snprintf(viewer->clip_name, sizeof(viewer->clip_name), "%s", info ? info->name : "");
    viewer->must_show = true;
    viewer->moved_ns = monotonic_now_ns();
}

/* Clips that hold nothing are passed over. */
static void next_clip(struct viewer *viewer, int step)
{
    struct fl_scene *scene = session_scene(viewer->session);
    int clip = tour_clip(&viewer->tour, step);
    for (size_t tries = 0; tries < viewer->tour.clip_count && clip != TOUR_NONE; tries++) {
        if (fl_scene_clip(scene, (size_t)clip)->clip != 0)
            break;
        clip = tour_clip(&viewer->tour, step);
    }
    if (viewer->tour.clip_count == 0)
        viewer_say(viewer, "the scene has no clips");
    viewer_choose_clip(viewer, clip);
}

static void next_camera(struct viewer *viewer, int step)
{
    const int camera = tour_camera(&viewer->tour, step);
    if (camera == TOUR_NONE) {
        viewer_say(viewer, "the scene has no cameras");
        return;
    }
    const struct fl_camera_info *info = fl_scene_camera(session_scene(viewer->session), (size_t)camera);
    viewer->camera_node = info->node;
    snprintf(viewer->camera_name, sizeof(viewer->camera_name), "%s", info->name);
    viewer->wanted = TASK_CAMERA;
}

/* Asks what is under the pointer. */
static void point(struct viewer *viewer, enum viewer_task task)
{
    if (viewer->live.width == 0 || !viewer->has_camera)
        return;
    viewer->focus_x = viewer->pointer_x / viewer->width;
    viewer->focus_y = viewer->pointer_y / viewer->height;
    /* In the view that the pointer is in; what an eye sees there is about what is seen from between them. */
    double *along = viewer->options->stereo_over ? &viewer->focus_y : &viewer->focus_x;
    if (viewer->settings.stereo)
        *along = 2 * *along - (*along < 0.5 ? 0 : 1);
    viewer->wanted = task;
}

static void play(struct viewer *viewer)
{
    if (viewer->tour.clip == TOUR_NONE)
        next_clip(viewer, 1);
    else
        tour_play(&viewer->tour);
    viewer->moved_ns = monotonic_now_ns();
}

static void screenshot(struct viewer *viewer)
{
    char path[64];
    struct fl_error error = {0};
    snprintf(path, sizeof(path), "farlight-%u.png", ++viewer->screenshots);
    if (viewer_screenshot(viewer, path, &error))
        viewer_say(viewer, "%s written", path);
    else
        viewer_say(viewer, "%s: %s", path, error.text);
}

/* What needs the scene. */
static void act_on_scene(struct viewer *viewer, enum action action)
{
    switch (action) {
    case ACTION_HOME:
        if (viewer->has_home)
            viewer_go(viewer, &viewer->home, viewer_home_node(viewer));
        viewer->tour.camera = TOUR_NONE;
        break;
    case ACTION_FOCUS:
        point(viewer, TASK_FOCUS);
        break;
    case ACTION_PICK:
        point(viewer, TASK_PICK);
        break;
    case ACTION_EDIT:
        viewer_edit_toggle(viewer);
        break;
    case ACTION_UNDO:
    case ACTION_REDO:
        viewer_edit_undo(viewer, action == ACTION_REDO);
        break;
    case ACTION_NEXT_CAMERA:
    case ACTION_PREVIOUS_CAMERA:
        next_camera(viewer, action == ACTION_NEXT_CAMERA ? 1 : -1);
        break;
    case ACTION_NEXT_CLIP:
    case ACTION_PREVIOUS_CLIP:
        next_clip(viewer, action == ACTION_NEXT_CLIP ? 1 : -1);
        break;
    case ACTION_PLAY:
        play(viewer);
        break;
    case ACTION_SLOWER:
    case ACTION_FASTER:
        tour_change_speed(&viewer->tour, action == ACTION_FASTER ? 1 : -1);
        break;
    case ACTION_STEP_BACK:
    case ACTION_STEP_ON:
        viewer->must_look |= tour_seek(&viewer->tour, action == ACTION_STEP_ON ? STEP_S : -STEP_S);
        break;
    default:
        break;
    }
}

static void act(struct viewer *viewer, enum action action)
{
    const struct settings before = viewer->settings;
    const bool is_of_panel = before.panel && settings_is_of_panel(action);
    const enum settings_change change = settings_act(&viewer->settings, action);
    struct setting_fault fault;
    if (change == SETTINGS_VIEW && !tracer_settings_check(&viewer->settings.tracers, "--", &fault)) {
        viewer->settings = before;
        viewer_say(viewer, "%s: %s", fault.field, fault.text);
        return;
    }
    viewer->must_show |= change == SETTINGS_VIEW;
    if (change == SETTINGS_VIEW)
        viewer->refused[0] = '\0'; /* it may be possible now */
    viewer->must_draw = true;
    viewer->has_heat = viewer->has_heat && viewer->settings.error_map;
    if (action == ACTION_QUIT && viewer->settings.help)
        viewer->settings.help = false;
    else if (action == ACTION_QUIT)
        viewer->quit = true;
    else if (action == ACTION_SCREENSHOT)
        screenshot(viewer);
    else if (action == ACTION_FULL_SCREEN && viewer->window)
        window_toggle_full_screen(viewer->window);
    else if (!is_of_panel && session_scene(viewer->session))
        act_on_scene(viewer, action);
}

/* ---- all input ---- */

void viewer_input(struct viewer *viewer, const struct input *input)
{
    if (input->kind == INPUT_MOTION || input->kind == INPUT_BUTTON_DOWN) {
        viewer->pointer_x = input->x;
        viewer->pointer_y = input->y;
    }
    if (viewer_edit_input(viewer, input))
        return;
    switch (input->kind) {
    case INPUT_QUIT:
        viewer->quit = true;
        return;
    case INPUT_RESIZE:
        viewer->must_show |= viewer->width != input->width || viewer->height != input->height;
        viewer->width = input->width;
        viewer->height = input->height;
        viewer->scale = input->scale;
        viewer->must_draw = true;
        return;
    case INPUT_DROP:
        viewer_open(viewer, input->path);
        return;
    case INPUT_KEY_DOWN:
        act(viewer, input_action(input));
        break;
    case INPUT_BUTTON_DOWN:
        if (input->button == INPUT_LEFT && input->ctrl) {
            act(viewer, ACTION_PICK);
            return;
        }
        if (input->button == INPUT_LEFT && input->clicks == 2)
            act(viewer, ACTION_FOCUS);
        break;
    default:
        break;
    }
    if (!viewer->has_camera || !controls_input(&viewer->controls, input, viewer->height, &viewer->camera))
        return;
    viewer->glide_begin_ns = 0; /* a hand is stronger */
    viewer->followed = 0;
    viewer->must_look = true;
    viewer->moved_ns = monotonic_now_ns();
}

/* ---- a replay ---- */

static bool has_come(const struct viewer *viewer, const struct replay_event *event)
{
    const bool is_live = !viewer->next && viewer->times_live > 0 && session_has_scene(viewer->session) &&
                         viewer->times_live == session_times_live(viewer->session);
    switch (event->kind) {
    case REPLAY_REST:
        return is_live && viewer_is_at_rest(viewer, event->samples) && viewer->task == TASK_NONE &&
               viewer->wanted == TASK_NONE && !viewer_outline_is_due(viewer) &&
               (!viewer->settings.error_map || viewer->has_heat || viewer->heat_refused);
    case REPLAY_LIVE:
        return is_live && viewer->has_camera && viewer->frames > 0;
    case REPLAY_LOST:
        return viewer->times_live > 0 && !session_has_scene(viewer->session);
    case REPLAY_CHANGE:
        return session_scene(viewer->session) &&
               fl_scene_revision(session_scene(viewer->session)) > viewer->replay_revision;
    case REPLAY_CAMERA:
        return viewer_shows_camera(viewer);
    default:
        return true;
    }
}

static bool is_wait(const struct replay_event *event)
{
    return event->kind != REPLAY_INPUT && event->kind != REPLAY_SCREENSHOT && event->kind != REPLAY_STATE;
}

static void do_event(struct viewer *viewer, const struct replay_event *event)
{
    if (event->kind == REPLAY_INPUT)
        viewer_input(viewer, &event->input);
    else if (event->kind == REPLAY_SCREENSHOT)
        viewer_keep_screenshot(viewer, event->path, &viewer->failure);
    else if (event->kind == REPLAY_STATE && viewer_write_screenshots(viewer, &viewer->failure))
        viewer_print_state(viewer, event->path);
}

void viewer_replay(struct viewer *viewer, uint64_t now_ns)
{
    const struct viewer_edit *edit = &viewer->edit;
    while (viewer->replay_next < viewer->replay.count && viewer->failure.code == FL_ERROR_NONE) {
        const struct replay_event *event = &viewer->replay.events[viewer->replay_next];
        /* What follows an edit or a change of files finds it made; but a drag goes on meanwhile. */
        if (session_reads(viewer->session))
            return;
        if ((edit->works || edit->has_pending) && !(edit->dragging && event->kind == REPLAY_INPUT))
            return;
        const uint64_t due_ns = viewer->replay_ns + (uint64_t)(event->after_s * 1e9);
        if (now_ns < due_ns)
            return;
        if (!has_come(viewer, event)) {
            viewer_write_screenshots(viewer, &viewer->failure);
            if (now_ns >= due_ns + (uint64_t)(event->timeout_s * 1e9))
                fl_error_set(&viewer->failure, FL_ERROR_TIMEOUT, viewer->options->replay,
                             "event %zu: the awaited state did not occur within %g s", event->number,
                             event->timeout_s);
            return;
        }
        do_event(viewer, event);
        viewer->replay_next++;
        if (session_scene(viewer->session) && !edit->works)
            viewer->replay_revision = fl_scene_revision(session_scene(viewer->session));
        viewer->replay_ns = is_wait(event) ? monotonic_now_ns() : due_ns;
    }
    if (viewer->replay_next == viewer->replay.count) {
        viewer_write_screenshots(viewer, &viewer->failure);
        viewer->quit = true;
    }
}
