/* SPDX-License-Identifier: MIT */
/* Actions of the user or of a replay: keys, clips, cameras and the object under the pointer. */
#include "state.h"
#include "protocol/common/clock.h"

#include <stdio.h>
#include <string.h>

#define STEP_S (1.0 / 24) /* step of a clip by key */

/* ---- keys ---- */

void viewer_choose_clip(struct viewer *viewer, int clip)
{
    struct view *view = &viewer->view;
    const struct fl_clip_info *info =
        clip != TOUR_NONE ? fl_scene_clip(session_scene(view->session), (size_t)clip) : NULL;
    tour_set_duration(&view->eye.tour, info ? (double)info->duration_s : 0);
    snprintf(view->eye.clip_name, sizeof(view->eye.clip_name), "%s", info ? info->name : "");
    view->sent.must_send_view = true;
    view->eye.moved_ns = monotonic_now_ns();
}

/* Skips clips that cannot be played. */
static void next_clip(struct viewer *viewer, int step)
{
    struct view *view = &viewer->view;
    struct fl_scene *scene = session_scene(view->session);
    int clip = tour_clip(&view->eye.tour, step);
    for (size_t tries = 0; tries < view->eye.tour.clip_count && clip != TOUR_NONE; tries++) {
        if (fl_scene_clip(scene, (size_t)clip)->clip != 0)
            break;
        clip = tour_clip(&view->eye.tour, step);
    }
    if (view->eye.tour.clip_count == 0)
        screen_say(&viewer->screen, "the scene has no clips");
    viewer_choose_clip(viewer, clip);
}

static void next_camera(struct viewer *viewer, int step)
{
    struct view *view = &viewer->view;
    const int camera = tour_camera(&view->eye.tour, step);
    if (camera == TOUR_NONE) {
        screen_say(&viewer->screen, "the scene has no cameras");
        return;
    }
    const struct fl_camera_info *info = fl_scene_camera(session_scene(view->session), (size_t)camera);
    view->tasks.camera_node = info->node;
    snprintf(view->eye.camera_name, sizeof(view->eye.camera_name), "%s", info->name);
    view->tasks.next = TASK_CAMERA;
}

/* Starts a query for the object under the pointer. */
static void point(struct viewer *viewer, enum view_task task)
{
    struct view *view = &viewer->view;
    if (view->frames.live.width == 0 || !view->eye.has_camera)
        return;
    view->tasks.x = viewer->screen.pointer_x / viewer->screen.width;
    view->tasks.y = viewer->screen.pointer_y / viewer->screen.height;
    /* The pointer's place in the view that it is in. The query is rendered for one eye between both, which sees
     * about the same there. */
    double *along = viewer->options->view.stereo_over ? &view->tasks.y : &view->tasks.x;
    if (view->settings.stereo)
        *along = 2 * *along - (*along < 0.5 ? 0 : 1);
    view->tasks.next = task;
}

static void play(struct viewer *viewer)
{
    struct view *view = &viewer->view;
    if (view->eye.tour.clip == TOUR_NONE)
        next_clip(viewer, 1);
    else
        tour_play(&view->eye.tour);
    view->eye.moved_ns = monotonic_now_ns();
}

static void screenshot(struct viewer *viewer)
{
    char path[64];
    struct fl_error error = {0};
    snprintf(path, sizeof(path), "farlight-%u.png", ++viewer->screenshots);
    if (viewer_screenshot(viewer, path, &error))
        screen_say(&viewer->screen, "%s written", path);
    else
        screen_say(&viewer->screen, "%s: %s", path, error.text);
}

/* Runs an action that needs the scene. */
static void act_on_scene(struct viewer *viewer, enum action action)
{
    struct view *view = &viewer->view;
    switch (action) {
    case ACTION_HOME:
        if (view->eye.has_home)
            view_go(view, &view->eye.home, view_home_node(view));
        view->eye.tour.camera = TOUR_NONE;
        break;
    case ACTION_FOCUS:
        point(viewer, TASK_FOCUS);
        break;
    case ACTION_PICK:
        point(viewer, TASK_PICK);
        break;
    case ACTION_EDIT:
        editor_toggle(&viewer->edit);
        break;
    case ACTION_UNDO:
    case ACTION_REDO:
        editor_undo(&viewer->edit, action == ACTION_REDO);
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
        tour_change_speed(&view->eye.tour, action == ACTION_FASTER ? 1 : -1);
        break;
    case ACTION_STEP_BACK:
    case ACTION_STEP_ON:
        view->sent.must_send_camera |= tour_seek(&view->eye.tour, action == ACTION_STEP_ON ? STEP_S : -STEP_S);
        break;
    default:
        break;
    }
}

static void act(struct viewer *viewer, enum action action)
{
    struct view *view = &viewer->view;
    const struct settings before = view->settings;
    const bool is_of_panel = before.panel && settings_is_of_panel(action);
    const enum settings_change change = settings_act(&view->settings, action);
    struct setting_fault fault;
    if (change == SETTINGS_VIEW && !tracer_settings_check(&view->settings.tracers, "--", &fault)) {
        view->settings = before;
        screen_say(&viewer->screen, "%s: %s", fault.field, fault.text);
        return;
    }
    view->sent.must_send_view |= change == SETTINGS_VIEW;
    if (change == SETTINGS_VIEW)
        view->refused[0] = '\0'; /* the new settings may be possible */
    viewer->screen.must_draw = true;
    view->heat.is_there = view->heat.is_there && view->settings.error_map;
    if (action == ACTION_QUIT && view->settings.help)
        view->settings.help = false;
    else if (action == ACTION_QUIT)
        viewer->quit = true;
    else if (action == ACTION_SCREENSHOT)
        screenshot(viewer);
    else if (action == ACTION_FULL_SCREEN && viewer->screen.window)
        window_toggle_full_screen(viewer->screen.window);
    else if (!is_of_panel && session_scene(view->session))
        act_on_scene(viewer, action);
}

/* ---- all input ---- */

void viewer_input(struct viewer *viewer, const struct input *input)
{
    struct view *view = &viewer->view;
    if (input->kind == INPUT_MOTION || input->kind == INPUT_BUTTON_DOWN) {
        viewer->screen.pointer_x = input->x;
        viewer->screen.pointer_y = input->y;
    }
    if (!view->settings.help && editor_input(&viewer->edit, input))
        return;
    switch (input->kind) {
    case INPUT_QUIT:
        viewer->quit = true;
        return;
    case INPUT_RESIZE:
        view->sent.must_send_view |=
            viewer->screen.width != input->width || viewer->screen.height != input->height;
        viewer->screen.width = input->width;
        viewer->screen.height = input->height;
        viewer->screen.scale = input->scale;
        viewer->screen.must_draw = true;
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
    if (!view->eye.has_camera ||
        !controls_input(&viewer->controls, input, viewer->screen.height, &view->eye.camera))
        return;
    view->eye.glide_begin_ns = 0; /* input overrides a glide */
    view->eye.followed = 0;
    view->sent.must_send_camera = true;
    view->eye.moved_ns = monotonic_now_ns();
}

/* ---- a replay ---- */

static bool has_come(const struct viewer *viewer, const struct replay_event *event)
{
    const struct view *view = &viewer->view;
    const bool is_live = !viewer->opening.session && viewer->times_live > 0 && session_has_scene(view->session) &&
                         viewer->times_live == session_times_live(view->session);
    switch (event->kind) {
    case REPLAY_REST:
        return is_live && view_is_at_rest(view, event->samples) && view->tasks.current == TASK_NONE &&
               view->tasks.next == TASK_NONE && !view_outline_is_due(view) &&
               (!view->settings.error_map || view->heat.is_there || view->heat.is_refused);
    case REPLAY_LIVE:
        return is_live && view->eye.has_camera && view->frames.count > 0;
    case REPLAY_LOST:
        return viewer->times_live > 0 && !session_has_scene(view->session);
    case REPLAY_CHANGE:
        return session_scene(view->session) &&
               fl_scene_revision(session_scene(view->session)) > viewer->replaying.revision;
    case REPLAY_CAMERA:
        return view_shows_camera(view);
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
        viewer_keep_screenshot(viewer, event->path, &viewer->view.failure);
    else if (event->kind == REPLAY_STATE && viewer_write_screenshots(viewer, &viewer->view.failure))
        viewer_print_state(viewer, event->path);
}

void viewer_replay(struct viewer *viewer, uint64_t now_ns)
{
    struct view *view = &viewer->view;
    const struct editor *edit = &viewer->edit;
    while (viewer->replaying.next < viewer->replaying.events.count && view->failure.code == FL_ERROR_NONE) {
        const struct replay_event *event = &viewer->replaying.events.events[viewer->replaying.next];
        /* An event after an edit or a reload waits until that is done, but a drag continues. */
        if (session_reads(view->session))
            return;
        if ((edit->works || edit->choice.has_pending) && !(edit->choice.dragging && event->kind == REPLAY_INPUT))
            return;
        const uint64_t due_ns = viewer->replaying.ns + (uint64_t)(event->after_s * 1e9);
        if (now_ns < due_ns)
            return;
        if (!has_come(viewer, event)) {
            viewer_write_screenshots(viewer, &view->failure);
            if (now_ns >= due_ns + (uint64_t)(event->timeout_s * 1e9))
                fl_error_set(&view->failure, FL_ERROR_TIMEOUT, viewer->options->replay,
                             "event %zu: the awaited state did not occur within %g s", event->number,
                             event->timeout_s);
            return;
        }
        do_event(viewer, event);
        viewer->replaying.next++;
        if (session_scene(view->session) && !edit->works)
            viewer->replaying.revision = fl_scene_revision(session_scene(view->session));
        viewer->replaying.ns = is_wait(event) ? monotonic_now_ns() : due_ns;
    }
    if (viewer->replaying.next == viewer->replaying.events.count) {
        viewer_write_screenshots(viewer, &view->failure);
        viewer->quit = true;
    }
}
