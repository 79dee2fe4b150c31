/* SPDX-License-Identifier: MIT */
/* Opens scenes: that of the command line, and the file that is dropped on the window. The shown scene stays until
 * the other one is there. */
#include "viewer/viewer_state.h"
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
    viewer_say(user, "%s", line);
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
                                            .user = viewer,
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
    if (viewer->next) {
        viewer_say(viewer, "%.60s is being opened still", viewer->next_model);
        return;
    }
    viewer->next_model = strdup(path);
    if (viewer->next_model && fl_importer_check_file(path, &error))
        viewer->next = viewer_open_session(viewer, viewer->next_model, &error);
    if (viewer->next)
        return;
    free(viewer->next_model);
    viewer->next_model = NULL;
    fl_error_print(&error, line, sizeof(line));
    viewer_say(viewer, "%s", line);
}

/* Cameras, clips and nodes that the command line names are of its model. */
static void forget_scene(struct viewer *viewer)
{
    viewer->view = viewer->options->view;
    viewer->view.camera_path = fl_view_defaults().camera_path;
    viewer->view.keys = NULL;
    viewer->view.keys_count = 0;
    viewer->view.auto_node = 0;
    viewer_forget_local(viewer);
    viewer_edit_forget(viewer);
    viewer->has_camera = viewer->has_home = viewer->is_live = false;
    viewer->followed = 0;
    viewer->glide_begin_ns = 0;
    viewer->times_live = 0;
    viewer->frames = 0;
    viewer->structure_count = 0;
    viewer->refused[0] = '\0';
    viewer->wanted = TASK_NONE;
}

static void replace(struct viewer *viewer)
{
    session_destroy(viewer->session);
    free(viewer->model);
    viewer->session = viewer->next;
    viewer->model = viewer->next_model;
    viewer->next = NULL;
    viewer->next_model = NULL;
    viewer->notice_ns = 0; /* that it is being opened */
    forget_scene(viewer);
    if (viewer->window)
        window_set_title(viewer->window, viewer_scene_name(viewer));
}

void viewer_step_opening(struct viewer *viewer, uint64_t now_ns)
{
    char line[HUD_TEXT_MAX];
    double share = 0;
    if (!viewer->next || viewer_edit_works(viewer, false))
        return;
    const enum session_state state = session_step(viewer->next, now_ns);
    if (state == SESSION_LIVE) {
        replace(viewer);
    } else if (state == SESSION_FAILED) {
        fl_error_print(session_error(viewer->next), line, sizeof(line));
        viewer_say(viewer, "%s", line);
        viewer_abandon_opening(viewer);
    } else {
        const char *what = session_progress(viewer->next, &share);
        viewer_say(viewer, "opening %.60s: %.40s %.0f %%", viewer->next_model, what, share * 100);
    }
}

void viewer_abandon_opening(struct viewer *viewer)
{
    session_destroy(viewer->next);
    free(viewer->next_model);
    viewer->next = NULL;
    viewer->next_model = NULL;
}

void viewer_refuse_scene(struct viewer *viewer, const struct fl_error *refusal)
{
    if (viewer->model)
        snprintf(viewer->refused, sizeof(viewer->refused), "%.120s", refusal->text);
    else
        viewer->failure = *refusal;
    viewer->must_draw = true;
}
