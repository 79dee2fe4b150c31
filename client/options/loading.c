/* SPDX-License-Identifier: MIT */
/* Loading of the command line's scene into a daemon. */
#include "loading.h"
#include "complete.h"
#include "daemon.h"
#include "interrupt.h"
#include "models.h"
#include "progress.h"
#include "talk.h"
#include "watch.h"
#include "protocol/common/clock.h"
#include "protocol/plain_text.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

#define NOTES_SHOWN 20u

static void on_note(void *user, const struct fl_note *note)
{
    struct cli_loading *loading = user;
    if (loading->job->talk.quiet || loading->again || note->severity != PROTOCOL_SEVERITY_WARNING ||
        loading->warnings++ >= NOTES_SHOWN)
        return;
    cli_progress_clear(loading->progress);
    cli_note(note, false);
}

static void on_progress(void *user, uint64_t done_bytes, uint64_t total_bytes, const char *what)
{
    struct cli_loading *loading = user;
    cli_progress_import(loading->progress, done_bytes, total_bytes, what);
}

static bool connect_to(struct cli_loading *loading, struct fl_error *error)
{
    const struct cli_job *job = loading->job;
    const struct fl_connect_options connect = {.server = job->daemon.server,
                                               .key_file = cli_key_file(job->daemon.server, job->daemon.key_file),
                                               .name = "farlight",
                                               .interrupt_fd = cli_interrupt_fd(),
                                               .timeout_ms = loading->timeout_ms,
                                               .lost_after_ms = job->daemon.retries.lost_after_ms,
                                               .daemon_arguments = loading->daemon_arguments};
    loading->connect_begin_ns = monotonic_now_ns();
    loading->connection = fl_connect(&connect, error);
    return loading->connection != NULL;
}

/* True if the import is recorded: it is compared later, or the digest of a part depends on it. */
static bool remembers_import(const struct cli_job *job)
{
    return job->part.count > 0 ||
           (job->input.watch && cli_watch_can_edit_again(job->input.edits, job->input.edit_count));
}

static void fill_options(struct cli_loading *loading)
{
    const struct cli_job *job = loading->job;
    loading->load = (struct fl_load_options){.model = job->input.model,
                                             .models = job->input.models,
                                             .model_count = job->input.count,
                                             .input_fd = job->input.fd,
                                             .input_format = job->input.format,
                                             .environment = job->input.environment,
                                             .environment_degrees = job->input.environment_degrees,
                                             .without_studio = job->input.without_studio,
                                             .variant = job->input.variant,
                                             .point_size = job->input.point_size,
                                             .note = on_note,
                                             .progress = on_progress,
                                             .user = loading,
                                             .sharing = loading->sharing,
                                             .scene_name = loading->scene_name,
                                             .will_reload = remembers_import(job)};
}

static bool start_import(struct cli_loading *loading, struct fl_error *error)
{
    if (!cli_check_models(loading->job, error))
        return false;
    fill_options(loading);
    loading->import_begin_ns = monotonic_now_ns();
    loading->load.started = fl_import_start(&loading->load, error);
    return loading->load.started != NULL;
}

bool cli_loading_begin(struct cli_loading *loading, struct fl_error *error)
{
    return (loading->job->input.scene || start_import(loading, error)) && connect_to(loading, error);
}

/* Replaces the field of an error in an edit that --light-group has made by that option. */
static bool blame_light_group(const struct cli_job *job, struct fl_error *error)
{
    char text[sizeof(error->field)];
    for (size_t i = 0; i < job->input.edit_count; i++) {
        const struct fl_assignment *edit = &job->input.edits[i];
        const size_t group = (size_t)edit->values[0];
        if (strcmp(edit->field, "light_group") == 0 && group > 0 && group <= job->light_groups.count &&
            strcmp(error->field, fl_assignment_print(edit, text, sizeof(text))) == 0)
            snprintf(error->field, sizeof(error->field), "--light-group %s=%.100s",
                     job->light_groups.names[group - 1], edit->which);
    }
    return false;
}

/* Applies the job's edits to a scene that has just been loaded. */
static bool apply_edits(const struct cli_job *job, struct fl_scene *scene, struct fl_error *error)
{
    return job->input.edit_count == 0 ||
           fl_scene_edit(scene, job->input.edits, job->input.edit_count, NULL, error) ||
           blame_light_group(job, error);
}

static void print_warnings(struct cli_loading *loading)
{
    if (loading->warnings <= NOTES_SHOWN)
        return;
    cli_progress_clear(loading->progress);
    fprintf(stderr, "farlight: %u more warnings ('farlight info' lists them)\n", loading->warnings - NOTES_SHOWN);
}

/* Refuses a shared scene whose name exists but whose model is not loaded yet. */
static bool check_loaded(const struct fl_scene *scene, struct fl_error *error)
{
    if (fl_scene_revision(scene) > 0)
        return true;
    fl_error_set(error, FL_ERROR_REFUSED, "--scene",
                 "the scene is still empty; try again once its model is loaded");
    error->retryable = true;
    return false;
}

bool cli_loading_end(struct cli_loading *loading, struct fl_error *error)
{
    if (loading->job->input.scene) {
        loading->scene = fl_scene_attach(loading->connection, loading->job->input.scene, error);
        return loading->scene && check_loaded(loading->scene, error);
    }
    loading->scene = fl_scene_load(loading->connection, &loading->load, error);
    loading->load.started = NULL; /* the load took it over */
    print_warnings(loading);
    return loading->scene && apply_edits(loading->job, loading->scene, error);
}

bool cli_loading_again(struct cli_loading *loading, struct fl_error *error)
{
    loading->warnings = 0;
    if (!cli_check_models(loading->job, error))
        return false;
    fill_options(loading);
    struct fl_scene *scene = fl_scene_reload(loading->scene, &loading->load, error);
    print_warnings(loading);
    if (!scene)
        return false;
    loading->scene = scene;
    return apply_edits(loading->job, scene, error);
}

void cli_loading_print_sent(const struct cli_loading *loading, const char *what)
{
    const struct fl_import_stats *stats = fl_scene_import_stats(loading->scene);
    if (loading->job->talk.quiet)
        return;
    fputs("farlight: ", stderr);
    plain_text_print(stderr, what);
    fprintf(stderr, " is new; sent %.3f of %.3f MB\n", (double)stats->uploaded_bytes * 1e-6,
            (double)stats->offered_bytes * 1e-6);
}

void cli_loading_close(struct cli_loading *loading)
{
    fl_import_destroy(loading->load.started);
    fl_scene_destroy(loading->scene);
    fl_connection_destroy(loading->connection);
    loading->load.started = NULL;
    loading->scene = NULL;
    loading->connection = NULL;
}

bool cli_choose_camera(struct cli_job *job, const struct fl_scene *scene, struct fl_error *error)
{
    if (!job->input.scene)
        cli_move_camera(job, fl_scene_import_stats(scene)->origin);
    if (!cli_find_camera(&job->options, job->camera.name, job->camera.framed,
                         job->camera.has_framing || job->camera.is_orbit, scene, error))
        return false;
    cli_choose_ground(job, &job->options, scene);
    return true;
}
