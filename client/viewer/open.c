/* SPDX-License-Identifier: MIT */
/* Opening of scenes: from the command line, or a file dropped on the window. The present scene stays until the
 * new one is ready. */
#include "state.h"
#include "options/talk.h"
#include "lib/importer.h"
#include "protocol/common/clock.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void say_stale(void *user, const struct fl_error *error)
{
    char line[1200];
    fl_error_print(error, line, sizeof(line));
    screen_say(user, "%s", line);
    cli_report(error);
}

struct session *viewer_open_session(struct viewer *viewer, const char *dropped, struct fl_error *error)
{
    const struct viewer_options *options = viewer->options;
    const struct session_options session = {.server = options->server,
                                            .key_file = options->key_file,
                                            .model = dropped ? dropped : options->model,
                                            .models = dropped ? NULL : options->models,
                                            .model_count = dropped ? 0 : options->model_count,
                                            .input_fd = options->input_fd,
                                            .watch = options->watch,
                                            .stale = say_stale,
                                            .user = &viewer->screen,
                                            .environment = options->environment,
                                            .environment_degrees = options->environment_degrees,
                                            .without_studio = options->without_studio,
                                            .variant = dropped ? NULL : options->variant,
                                            .edits = dropped ? NULL : options->edits,
                                            .edit_count = dropped ? 0 : options->edit_count,
                                            .point_size = options->point_size,
                                            .scene_name = dropped ? NULL : options->scene_name,
                                            .has_retry_for = options->has_retry_for && !dropped,
                                            .retry_for_s = options->retry_for_s,
                                            .lost_after_ms = options->lost_after_ms,
                                            .interrupt_fd = options->interrupt_fd,
                                            .note = options->note};
    return session_create(&session, error);
}

const char *viewer_scene_name(const struct viewer *viewer)
{
    const struct viewer_options *options = viewer->options;
    const char *path = viewer->model ? viewer->model : options->scene_name ? options->scene_name : options->model;
    const char *slash = viewer->model || !options->scene_name ? strrchr(path, '/') : NULL;
    return slash ? slash + 1 : path;
}

void viewer_open(struct viewer *viewer, const char *path)
{
    struct fl_error error = {0};
    char line[HUD_TEXT_MAX];
    if (viewer->opening.session) {
        screen_say(&viewer->screen, "%.60s is being opened still", viewer->opening.model);
        return;
    }
    viewer->opening.model = strdup(path);
    if (viewer->opening.model && fl_importer_check_file(path, &error))
        viewer->opening.session = viewer_open_session(viewer, viewer->opening.model, &error);
    if (viewer->opening.session)
        return;
    free(viewer->opening.model);
    viewer->opening.model = NULL;
    fl_error_print(&error, line, sizeof(line));
    screen_say(&viewer->screen, "%s", line);
}

/* Forgets cameras, clips and nodes named on the command line: they belong to its model. */
static void forget_scene(struct viewer *viewer)
{
    struct view *view = &viewer->view;
    view->render = viewer->options->view.render;
    view->render.camera.camera_path = fl_view_defaults().camera.camera_path;
    view->render.keys = NULL;
    view->render.keys_count = 0;
    view->render.camera.auto_node = 0;
    view_forget_local(view);
    editor_forget(&viewer->edit);
    view->eye.has_camera = view->eye.has_home = view->frames.is_live = false;
    view->eye.followed = 0;
    view->eye.glide_begin_ns = 0;
    viewer->times_live = 0;
    view->frames.count = 0;
    view->frames.structure_count = 0;
    view->refused[0] = '\0';
    view->tasks.next = TASK_NONE;
}

static void replace(struct viewer *viewer)
{
    struct view *view = &viewer->view;
    session_destroy(view->session);
    free(viewer->model);
    view->session = viewer->edit.session = viewer->opening.session;
    viewer->model = viewer->opening.model;
    view->is_dropped = true;
    viewer->opening.session = NULL;
    viewer->opening.model = NULL;
    viewer->screen.notice_ns = 0; /* ends the notice that it is being opened */
    forget_scene(viewer);
    if (viewer->screen.window)
        window_set_title(viewer->screen.window, viewer_scene_name(viewer));
}

void viewer_step_opening(struct viewer *viewer, uint64_t now_ns)
{
    char line[HUD_TEXT_MAX];
    double share = 0;
    if (!viewer->opening.session || editor_works(&viewer->edit, false))
        return;
    const enum session_state state = session_step(viewer->opening.session, now_ns);
    if (state == SESSION_LIVE) {
        replace(viewer);
    } else if (state == SESSION_FAILED) {
        fl_error_print(session_error(viewer->opening.session), line, sizeof(line));
        screen_say(&viewer->screen, "%s", line);
        viewer_abandon_opening(viewer);
    } else {
        const char *what = session_progress(viewer->opening.session, &share);
        screen_say(&viewer->screen, "opening %.60s: %.40s %.0f %%", viewer->opening.model, what, share * 100);
    }
}

void viewer_abandon_opening(struct viewer *viewer)
{
    session_destroy(viewer->opening.session);
    free(viewer->opening.model);
    viewer->opening.session = NULL;
    viewer->opening.model = NULL;
}
