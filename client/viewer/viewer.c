/* SPDX-License-Identifier: MIT */
/* The viewer's loop: it opens the window and the session, then handles input, frames and reloads until it ends. */
#include "viewer.h"
#include "state.h"
#include "options/complete.h"
#include "options/talk.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define BUSY_WAIT_MS 2u /* while the user is active; a frame ends the wait, input does not */
#define IDLE_WAIT_MS 8u
#define BUSY_NS 1000000000ull
#define REDRAW_NS 250000000ull /* the overlay's figures are redrawn even without frames */

/* ---- a scene that has become live ---- */

/* Resolves the names on the command line, now that the scene is known. */
static bool settle(struct viewer *viewer, struct fl_error *error)
{
    struct view *view = &viewer->view;
    const struct viewer_options *options = viewer->options;
    struct message_render *job = &view->render;
    struct fl_scene *scene = session_scene(view->session);
    uint32_t clip = 0;
    tour_begin(&view->eye.tour, fl_scene_camera_count(scene), fl_scene_clip_count(scene));
    view->eye.tour.speed = options->speed;
    if (viewer->model) /* the names on the command line belong to another model */
        return cli_find_camera(job, NULL, NULL, options->has_framing, scene, error);
    if (!cli_find_camera(job, options->camera, options->framed, options->has_framing, scene, error))
        return false;
    if (!options->clip)
        return true;
    if (!fl_scene_find_clip(scene, options->clip, &clip, NULL, error))
        return false;
    for (size_t i = 0; i < view->eye.tour.clip_count; i++)
        if (fl_scene_clip(scene, i)->clip == clip)
            viewer_choose_clip(viewer, tour_clip(&view->eye.tour, (int)i - view->eye.tour.clip));
    return true;
}

static int camera_of_name(const struct fl_scene *scene, const char *name)
{
    for (size_t i = 0; i < fl_scene_camera_count(scene); i++)
        if (strcmp(fl_scene_camera(scene, i)->name, name) == 0)
            return (int)i;
    return TOUR_NONE;
}

static int clip_of_name(const struct fl_scene *scene, const char *name)
{
    for (size_t i = 0; i < fl_scene_clip_count(scene); i++)
        if (strcmp(fl_scene_clip(scene, i)->name, name) == 0)
            return (int)i;
    return TOUR_NONE;
}

/* Adapts the tour to a model that was loaded again: numbers of cameras and clips may have changed, or just
 * their names. */
static void fit_tour(struct viewer *viewer)
{
    struct view *view = &viewer->view;
    const struct fl_scene *scene = session_scene(view->session);
    const size_t cameras = fl_scene_camera_count(scene), clips = fl_scene_clip_count(scene);
    struct tour *tour = &view->eye.tour;
    if (tour->camera_count != cameras || tour->clip_count != clips) {
        tour->camera = tour->camera != TOUR_NONE ? camera_of_name(scene, view->eye.camera_name) : TOUR_NONE;
        tour->clip = tour->clip != TOUR_NONE ? clip_of_name(scene, view->eye.clip_name) : TOUR_NONE;
        tour->camera_count = cameras;
        tour->clip_count = clips;
        view->eye.followed = 0;
        view->sent.must_send_view = true;
    }
    if (tour->clip == TOUR_NONE)
        tour_stop(tour);
    else
        tour_set_duration(tour, (double)fl_scene_clip(scene, (size_t)tour->clip)->duration_s);
}

/* Handles changed files of the scene that is shown; the view stays. */
static void take_changes(struct viewer *viewer)
{
    const struct fl_import_stats *stats = fl_scene_import_stats(session_scene(viewer->view.session));
    fit_tour(viewer);
    viewer->times_read = session_times_read(viewer->view.session);
    editor_read_again(&viewer->edit, true);
    screen_say(&viewer->screen, "%.60s is read again; sent %.3f of %.3f MB", viewer_scene_name(viewer),
               (double)stats->uploaded_bytes * 1e-6, (double)stats->offered_bytes * 1e-6);
}

static void begin_showing(struct viewer *viewer)
{
    struct view *view = &viewer->view;
    if (viewer->times_live == 0 && !settle(viewer, &view->failure))
        return;
    fit_tour(viewer);
    if (viewer->times_live > 0)
        editor_read_again(&viewer->edit, viewer->times_read == session_times_read(view->session));
    viewer->times_live = session_times_live(view->session);
    viewer->times_read = session_times_read(view->session);
    view_drop_tasks(view);
    view->frames.metrics = (struct metrics){0}; /* another daemon has another clock */
    view->sent.has_sent_camera = view->sent.moving = false;
    view->frames.last.command = 0;
    view->sent.must_send_view = true;
    view_forget_local(view);
}

/* ---- the loop ---- */

/* Advances motion without input: the tour and glides. */
static void tick(struct viewer *viewer, uint64_t now_ns)
{
    struct view *view = &viewer->view;
    const double seconds = (double)(now_ns - viewer->tick_ns) * 1e-9;
    viewer->tick_ns = now_ns;
    if (!view->eye.has_camera)
        return;
    bool moved = view_glide(view, now_ns);
    if (controls_fly(&viewer->controls, seconds, &view->eye.camera)) {
        view->eye.followed = 0;
        moved = true;
    }
    moved = tour_advance(&view->eye.tour, seconds) || moved;
    view->sent.must_send_camera = view->sent.must_send_camera || moved;
    view->eye.moved_ns = moved ? now_ns : view->eye.moved_ns;
}

static void take_input(struct viewer *viewer, uint64_t now_ns)
{
    struct input input;
    while (viewer->screen.window && window_poll(viewer->screen.window, &input))
        /* A replay ignores all input except closing the window. */
        if (!viewer->options->replay || input.kind == INPUT_QUIT || input.kind == INPUT_RESIZE)
            viewer_input(viewer, &input);
    if (viewer->options->replay)
        viewer_replay(viewer, now_ns);
}

static void serve(struct viewer *viewer, uint64_t now_ns)
{
    struct view *view = &viewer->view;
    const bool is_busy = view->eye.moved_ns + BUSY_NS > now_ns || viewer->replaying.events.count > 0;
    const unsigned wait_ms = viewer->screen.must_draw ? 0 : is_busy ? BUSY_WAIT_MS : IDLE_WAIT_MS;
    if (editor_works(&viewer->edit, false)) {
        poll(NULL, 0, (int)wait_ms);
        return;
    }
    const enum session_state state = session_step(view->session, now_ns);
    if (state == SESSION_FAILED) {
        view->failure = *session_error(view->session);
        return;
    }
    if (state != SESSION_LIVE) {
        poll(NULL, 0, (int)wait_ms); /* views are still made from the last key */
        return;
    }
    if (viewer->times_live != session_times_live(view->session))
        begin_showing(viewer);
    else if (viewer->times_read != session_times_read(view->session))
        take_changes(viewer);
    if (view->failure.code != FL_ERROR_NONE)
        return;
    view_send(view, now_ns);
    view_receive(view, wait_ms);
    view_step_tasks(view);
    const struct view_picked picked = view->tasks.picked;
    view->tasks.picked.is_new = false;
    if (picked.is_new)
        editor_show(&viewer->edit, picked.node, picked.material);
    view_step_outline(view);
    editor_step(&viewer->edit, now_ns);
}

static void draw(struct viewer *viewer)
{
    struct hud_state state;
    if (!viewer->screen.window)
        return;
    viewer->screen.must_draw |= window_wants_drawing(viewer->screen.window);
    if (!viewer->screen.must_draw && monotonic_now_ns() < viewer->screen.drawn_ns + REDRAW_NS)
        return;
    viewer_hud(viewer, &state);
    window_show(viewer->screen.window, view_picture(&viewer->view), &state);
    metrics_show(&viewer->view.frames.metrics, monotonic_now_ns());
    viewer->screen.drawn_ns = monotonic_now_ns();
}

static bool run(struct viewer *viewer)
{
    struct view *view = &viewer->view;
    viewer->replaying.ns = viewer->tick_ns = monotonic_now_ns();
    while (!viewer->quit && view->failure.code == FL_ERROR_NONE) {
        const uint64_t now_ns = monotonic_now_ns();
        take_input(viewer, now_ns);
        tick(viewer, now_ns);
        view_step_local(view, now_ns);
        viewer_step_opening(viewer, now_ns);
        serve(viewer, now_ns);
        draw(viewer);
        viewer->screen.must_draw = false;
        if (viewer->options->interrupt_signal() != 0)
            fl_error_set(&view->failure, FL_ERROR_INTERRUPTED, "", "interrupted");
    }
    return view->failure.code == FL_ERROR_NONE;
}

/* ---- beginning and end ---- */

static bool open_viewer(struct viewer *viewer, struct fl_error *error)
{
    const struct viewer_options *options = viewer->options;
    const struct recall *recall = &options->recall;
    const struct window_place place = {.width = viewer->screen.width,
                                       .height = viewer->screen.height,
                                       .has_place = recall->has_place,
                                       .x = recall->x,
                                       .y = recall->y,
                                       .full_screen = recall->full_screen};
    if (options->replay && !replay_load(&viewer->replaying.events, options->replay, error))
        return false;
    if (!options->headless) {
        viewer->screen.window = window_create(viewer_scene_name(viewer), &place, error);
        if (!viewer->screen.window)
            return false;
        window_size(viewer->screen.window, &viewer->screen.width, &viewer->screen.height, &viewer->screen.scale);
    }
    /* The window is opened first: SDL starts programs of the desktop, and a daemon started meanwhile must not
     * inherit their pipes. */
    viewer->view.session = viewer->edit.session = viewer_open_session(viewer, NULL, error);
    return viewer->view.session != NULL;
}

/* Saves settings and window place. Failing to save does not fail the viewer. */
static void remember(const struct viewer *viewer)
{
    const struct viewer_options *options = viewer->options;
    struct recall recall = options->recall;
    struct window_place place = {.full_screen = recall.full_screen,
                                 .width = (int)lround(viewer->screen.width / viewer->screen.scale),
                                 .height = (int)lround(viewer->screen.height / viewer->screen.scale)};
    struct fl_error error = {0};
    if (!options->state)
        return;
    recall_note(&recall, &viewer->first, &viewer->view.settings);
    const bool is_placed = viewer->screen.window && window_get_place(viewer->screen.window, &place);
    if (is_placed) {
        recall.has_place = true;
        recall.x = place.x;
        recall.y = place.y;
    }
    recall.full_screen = place.full_screen;
    /* A size from the command line is not saved. */
    if (!place.full_screen && (place.width != (int)options->view.render.picture.width ||
                               place.height != (int)options->view.render.picture.height)) {
        recall.width = place.width;
        recall.height = place.height;
    }
    if (!recall_save(&recall, options->state, &error) && !options->quiet)
        cli_report(&error);
}

static void close_viewer(struct viewer *viewer)
{
    const uint64_t one = 1;
    /* Abandons a connection that the other thread is still opening. */
    if (write(viewer->options->interrupt_fd, &one, sizeof(one)) < 0)
        errno = 0; /* the descriptor is readable already */
    window_destroy(viewer->screen.window);
    viewer_abandon_opening(viewer);
    editor_works(&viewer->edit, true);
    view_finish(&viewer->view);
    editor_forget(&viewer->edit);
    free(viewer->model);
    viewer_write_screenshots(viewer, &(struct fl_error){0}); /* screenshots taken before a failure */
    replay_finish(&viewer->replaying.events);
}

bool viewer_run(const struct viewer_options *options, struct fl_error *error)
{
    struct viewer *viewer = calloc(1, sizeof(*viewer));
    if (!viewer)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    viewer->options = options;
    viewer->view.options = &options->view;
    viewer->view.screen = viewer->edit.screen = &viewer->screen;
    viewer->view.choice = &viewer->edit.choice;
    viewer->view.render = options->view.render;
    viewer->screen.width = (int)options->view.render.picture.width;
    viewer->screen.height = (int)options->view.render.picture.height;
    viewer->screen.scale = 1;
    viewer->edit.choice.tab = EDIT_MATERIAL;
    viewer->view.settings = (struct settings){.tracer = options->view.render.tracing.tracer,
                                              .integrator = options->view.render.light.integrator,
                                              .tone_map = options->view.render.picture.tone_map,
                                              .tracers = options->view.render.tracing.settings,
                                              .coarser = (int)options->coarser,
                                              .overlay = options->overlay,
                                              .stereo = options->stereo,
                                              .views = options->views,
                                              .local = options->local,
                                              .holes = options->holes};
    viewer->first = viewer->view.settings;
    const bool opened = open_viewer(viewer, error);
    const bool done = opened && run(viewer);
    if (opened)
        remember(viewer);
    if (opened && !done)
        *error = viewer->view.failure;
    close_viewer(viewer);
    free(viewer);
    return done;
}
