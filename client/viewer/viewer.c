/* SPDX-License-Identifier: MIT */
#include "viewer/viewer.h"
#include "viewer/viewer_state.h"
#include "options/complete.h"
#include "options/talk.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define NOTICE_NS 4000000000ull
#define GLIDE_NS 350000000ull
#define BUSY_WAIT_MS 2u /* while the user is active; frames end the wait, input does not */
#define IDLE_WAIT_MS 8u
#define BUSY_NS 1000000000ull
#define REDRAW_NS 250000000ull /* figures go on while no frame comes */

void viewer_say(struct viewer *viewer, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(viewer->notice, sizeof(viewer->notice), format, arguments);
    va_end(arguments);
    viewer->notice_ns = monotonic_now_ns() + NOTICE_NS;
    viewer->must_draw = true;
}

/* ---- a scene that has become live ---- */

/* What the command line names can be looked up now. */
static bool settle(struct viewer *viewer, struct fl_error *error)
{
    const struct viewer_options *options = viewer->options;
    struct message_render *job = &viewer->view;
    struct fl_scene *scene = session_scene(viewer->session);
    uint32_t clip = 0;
    tour_begin(&viewer->tour, fl_scene_camera_count(scene), fl_scene_clip_count(scene));
    viewer->tour.speed = options->speed;
    if (viewer->model) /* what the command line names is of its own */
        return cli_find_camera(job, NULL, NULL, options->has_framing, scene, error);
    if (!cli_find_camera(job, options->camera, options->framed, options->has_framing, scene, error))
        return false;
    if (!options->clip)
        return true;
    if (!fl_scene_find_clip(scene, options->clip, &clip, NULL, error))
        return false;
    for (size_t i = 0; i < viewer->tour.clip_count; i++)
        if (fl_scene_clip(scene, i)->clip == clip)
            viewer_choose_clip(viewer, tour_clip(&viewer->tour, (int)i - viewer->tour.clip));
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

/* A model that was loaded again may have other cameras and clips; where there are as many, names may be new. */
static void fit_tour(struct viewer *viewer)
{
    const struct fl_scene *scene = session_scene(viewer->session);
    const size_t cameras = fl_scene_camera_count(scene), clips = fl_scene_clip_count(scene);
    struct tour *tour = &viewer->tour;
    if (tour->camera_count != cameras || tour->clip_count != clips) {
        tour->camera = tour->camera != TOUR_NONE ? camera_of_name(scene, viewer->camera_name) : TOUR_NONE;
        tour->clip = tour->clip != TOUR_NONE ? clip_of_name(scene, viewer->clip_name) : TOUR_NONE;
        tour->camera_count = cameras;
        tour->clip_count = clips;
        viewer->followed = 0;
        viewer->must_show = true;
    }
    if (tour->clip == TOUR_NONE)
        tour_stop(tour);
    else
        tour_set_duration(tour, (double)fl_scene_clip(scene, (size_t)tour->clip)->duration_s);
}

/* Of the scene that is shown: the view goes on. */
static void take_changes(struct viewer *viewer)
{
    const struct fl_import_stats *stats = fl_scene_import_stats(session_scene(viewer->session));
    fit_tour(viewer);
    viewer->times_read = session_times_read(viewer->session);
    viewer_edit_read_again(viewer, true);
    viewer_say(viewer, "%.60s is read again; sent %.3f of %.3f MB", viewer_scene_name(viewer),
               (double)stats->uploaded_bytes * 1e-6, (double)stats->offered_bytes * 1e-6);
}

static void begin_showing(struct viewer *viewer)
{
    if (viewer->times_live == 0 && !settle(viewer, &viewer->failure))
        return;
    fit_tour(viewer);
    if (viewer->times_live > 0)
        viewer_edit_read_again(viewer, viewer->times_read == session_times_read(viewer->session));
    viewer->times_live = session_times_live(viewer->session);
    viewer->times_read = session_times_read(viewer->session);
    viewer_drop_tasks(viewer);
    viewer->metrics = (struct metrics){0}; /* another daemon has another clock */
    viewer->has_looked = viewer->told_moving = false;
    viewer->frame.command = 0;
    viewer->must_show = true;
    viewer_forget_local(viewer);
}

/* ---- the loop ---- */

/* What moves by itself. */
static void tick(struct viewer *viewer, uint64_t now_ns)
{
    const double seconds = (double)(now_ns - viewer->tick_ns) * 1e-9;
    bool moved = false;
    viewer->tick_ns = now_ns;
    if (!viewer->has_camera)
        return;
    if (viewer->glide_begin_ns != 0) {
        const double share = (double)(now_ns - viewer->glide_begin_ns) / GLIDE_NS;
        camera_between(&viewer->glide_from, &viewer->glide_to, share < 1 ? share : 1, &viewer->camera);
        viewer->glide_begin_ns = share < 1 ? viewer->glide_begin_ns : 0;
        moved = true;
    }
    if (controls_fly(&viewer->controls, seconds, &viewer->camera)) {
        viewer->followed = 0;
        moved = true;
    }
    moved = tour_advance(&viewer->tour, seconds) || moved;
    viewer->must_look = viewer->must_look || moved;
    viewer->moved_ns = moved ? now_ns : viewer->moved_ns;
}

static void take_input(struct viewer *viewer, uint64_t now_ns)
{
    struct input input;
    while (viewer->window && window_poll(viewer->window, &input))
        /* During a replay all input but the window's closing is ignored. */
        if (!viewer->options->replay || input.kind == INPUT_QUIT || input.kind == INPUT_RESIZE)
            viewer_input(viewer, &input);
    if (viewer->options->replay)
        viewer_replay(viewer, now_ns);
}

static void serve(struct viewer *viewer, uint64_t now_ns)
{
    const bool is_busy = viewer->moved_ns + BUSY_NS > now_ns || viewer->replay.count > 0;
    const unsigned wait_ms = viewer->must_draw ? 0 : is_busy ? BUSY_WAIT_MS : IDLE_WAIT_MS;
    if (viewer_edit_works(viewer, false)) {
        poll(NULL, 0, (int)wait_ms);
        return;
    }
    const enum session_state state = session_step(viewer->session, now_ns);
    if (state == SESSION_FAILED) {
        viewer->failure = *session_error(viewer->session);
        return;
    }
    if (state != SESSION_LIVE) {
        poll(NULL, 0, (int)wait_ms); /* views are made of what is there */
        return;
    }
    if (viewer->times_live != session_times_live(viewer->session))
        begin_showing(viewer);
    else if (viewer->times_read != session_times_read(viewer->session))
        take_changes(viewer);
    if (viewer->failure.code != FL_ERROR_NONE)
        return;
    viewer_tell(viewer, now_ns);
    viewer_receive(viewer, wait_ms);
    viewer_step_tasks(viewer);
    viewer_step_outline(viewer);
    viewer_step_edit(viewer, now_ns);
}

static void draw(struct viewer *viewer)
{
    struct hud_state state;
    if (!viewer->window)
        return;
    viewer->must_draw |= window_wants_drawing(viewer->window);
    if (!viewer->must_draw && monotonic_now_ns() < viewer->drawn_ns + REDRAW_NS)
        return;
    viewer_hud(viewer, &state);
    window_show(viewer->window, viewer_picture(viewer), &state);
    metrics_show(&viewer->metrics, monotonic_now_ns());
    viewer->drawn_ns = monotonic_now_ns();
}

static bool run(struct viewer *viewer)
{
    viewer->replay_ns = viewer->tick_ns = monotonic_now_ns();
    while (!viewer->quit && viewer->failure.code == FL_ERROR_NONE) {
        const uint64_t now_ns = monotonic_now_ns();
        take_input(viewer, now_ns);
        tick(viewer, now_ns);
        viewer_step_local(viewer, now_ns);
        viewer_step_opening(viewer, now_ns);
        serve(viewer, now_ns);
        draw(viewer);
        viewer->must_draw = false;
        if (viewer->options->interrupt_signal() != 0)
            fl_error_set(&viewer->failure, FL_ERROR_INTERRUPTED, "", "interrupted");
    }
    return viewer->failure.code == FL_ERROR_NONE;
}

/* ---- beginning and end ---- */

static bool open_viewer(struct viewer *viewer, struct fl_error *error)
{
    const struct viewer_options *options = viewer->options;
    const struct recall *recall = &options->recall;
    const struct window_place place = {.width = viewer->width,
                                       .height = viewer->height,
                                       .has_place = recall->has_place,
                                       .x = recall->x,
                                       .y = recall->y,
                                       .full_screen = recall->full_screen};
    if (options->replay && !replay_load(&viewer->replay, options->replay, error))
        return false;
    if (!options->headless) {
        viewer->window = window_create(viewer_scene_name(viewer), &place, error);
        if (!viewer->window)
            return false;
        window_size(viewer->window, &viewer->width, &viewer->height, &viewer->scale);
    }
    /* Only after the window is open: SDL starts programs of the desktop, whose pipes a daemon that is started
     * meanwhile must not inherit. */
    viewer->session = viewer_open_session(viewer, NULL, error);
    return viewer->session != NULL;
}

/* That it cannot be remembered is no failure of what was shown. */
static void remember(const struct viewer *viewer)
{
    const struct viewer_options *options = viewer->options;
    struct recall recall = options->recall;
    struct window_place place = {.full_screen = recall.full_screen,
                                 .width = (int)lround(viewer->width / viewer->scale),
                                 .height = (int)lround(viewer->height / viewer->scale)};
    struct fl_error error = {0};
    if (!options->state)
        return;
    recall_note(&recall, &viewer->first, &viewer->settings);
    const bool is_placed = viewer->window && window_get_place(viewer->window, &place);
    if (is_placed) {
        recall.has_place = true;
        recall.x = place.x;
        recall.y = place.y;
    }
    recall.full_screen = place.full_screen;
    /* A size from the command line is for once. */
    if (!place.full_screen &&
        (place.width != (int)options->view.width || place.height != (int)options->view.height)) {
        recall.width = place.width;
        recall.height = place.height;
    }
    if (!recall_save(&recall, options->state, &error) && !options->quiet)
        cli_report(&error);
}

static void close_viewer(struct viewer *viewer)
{
    const uint64_t one = 1;
    /* A connection that the other thread is still opening is abandoned. */
    if (write(viewer->options->interrupt_fd, &one, sizeof(one)) < 0)
        errno = 0; /* it is readable already */
    window_destroy(viewer->window);
    viewer_abandon_opening(viewer);
    viewer_edit_works(viewer, true);
    session_destroy(viewer->session);
    free(viewer->model);
    decoder_destroy(viewer->decoder);
    views_destroy(viewer->views);
    pixmap_finish(&viewer->arrived);
    pixmap_finish(&viewer->made);
    pixmap_finish(&viewer->live);
    pixmap_finish(&viewer->compared);
    pixmap_finish(&viewer->heat);
    viewer_edit_forget(viewer);
    viewer_outline_forget(viewer);
    viewer_write_screenshots(viewer, &(struct fl_error){0}); /* those that were taken before it failed */
    replay_finish(&viewer->replay);
}

bool viewer_run(const struct viewer_options *options, struct fl_error *error)
{
    struct viewer *viewer = calloc(1, sizeof(*viewer));
    if (!viewer)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    viewer->options = options;
    viewer->view = options->view;
    viewer->width = (int)options->view.width;
    viewer->height = (int)options->view.height;
    viewer->scale = 1;
    viewer->edit.tab = EDIT_MATERIAL;
    viewer->settings = (struct settings){.tracer = options->view.tracer,
                                         .integrator = options->view.integrator,
                                         .tone_map = options->view.tone_map,
                                         .tracers = options->view.settings,
                                         .coarser = (int)options->coarser,
                                         .overlay = options->overlay,
                                         .stereo = options->stereo,
                                         .views = options->views,
                                         .local = options->local,
                                         .holes = options->holes};
    viewer->first = viewer->settings;
    const bool opened = open_viewer(viewer, error);
    const bool done = opened && run(viewer);
    if (opened)
        remember(viewer);
    if (opened && !done)
        *error = viewer->failure;
    close_viewer(viewer);
    free(viewer);
    return done;
}
