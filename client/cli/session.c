/* SPDX-License-Identifier: MIT */
/* From a model to image files, once: the scene handed over, frames taken and written. */
#include "cli/cli.h"
#include "cli/trace_file.h"
#include "lib/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

struct session {
    struct cli_job *job;
    bool is_series, to_stdout;
    struct fl_pattern pattern;
    char folder[4096], path[4352]; /* where the image goes; of a series, for each frame anew */
    char temporary[4096];          /* a folder to be removed; empty: none */
    struct fl_exporter *exporter;
    struct cli_loading loading;
    struct fl_job *rendering;
    struct cli_timings *timings;
    struct cli_trace_file *trace; /* NULL: none is wanted */
    struct cli_progress progress;
    uint64_t begin_ns, export_ns;
};

static uint64_t now_ns(void)
{
    struct timespec now = {0};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

/* ---- beginning ---- */

/* Everything that can be known to fail before anything is rendered. */
static bool prepare_output(struct session *session, struct fl_error *error)
{
    struct cli_job *job = session->job;
    session->to_stdout = strcmp(job->output, "-") == 0;
    if (session->to_stdout) {
        if (isatty(STDOUT_FILENO) == 1) {
            fl_error_set(error, FL_ERROR_ARGUMENT, "--output", "an image would be written to the terminal");
            return fl_error_remedy(error, "redirect it, or name a file");
        }
        if (!cli_temporary_folder(session->folder, sizeof session->folder, error))
            return false;
        memcpy(session->temporary, session->folder, sizeof session->temporary);
        snprintf(session->path, sizeof session->path, "%s/image.%s", session->folder, cli_image_name(job->image));
        return true;
    }
    if (!session->is_series)
        return cli_check_output(job->output, session->folder, sizeof session->folder, error) &&
               snprintf(session->path, sizeof session->path, "%s", job->output) > 0;
    if (!fl_pattern_parse(job->output, &session->pattern, error)) {
        snprintf(error->field, sizeof error->field, "--output");
        return false;
    }
    return fl_pattern_path(&session->pattern, job->options.last_frame, session->path, sizeof session->path) &&
           cli_check_output(session->path, session->folder, sizeof session->folder, error);
}

static bool begin_trace(struct session *session, struct fl_error *error)
{
    const struct cli_job *job = session->job;
    const char *const others[] = {job->model, job->environment, job->keys_file};
    if (job->trace_file == NULL)
        return true;
    if (!cli_check_not_input(job->trace_file, "--trace-file", others, 3, error))
        return false;
    session->trace = cli_trace_file_create(job->trace_file, error);
    return session->trace != NULL;
}

static bool start_exporter(struct session *session, struct fl_error *error)
{
    const struct cli_job *job = session->job;
    const struct fl_exporter_options export = {.folder = session->folder,
                                               .model = job->model,
                                               .frames_per_second =
                                                   session->is_series ? job->options.frames_per_second : 0,
                                               .interrupt_fd = cli_interrupt_fd()};
    session->exporter = fl_exporter_start(&export, error);
    return session->exporter != NULL;
}

/* The importer loads its libraries beside the daemon's start, and the exporter beside the importer: once the scene
 * is there the daemon wants all processors. */
static bool load_scene(struct session *session, struct fl_error *error)
{
    struct cli_loading *loading = &session->loading;
    if (!cli_loading_begin(loading, error))
        return false;
    cli_trace_span(session->trace, CLI_TRACE_CLIENT, "start", -1, loading->connect_begin_ns,
                   fl_connection_start_ns(loading->connection));
    if (!start_exporter(session, error) || !cli_loading_end(loading, error))
        return false;
    cli_trace_import(session->trace, fl_scene_import_stats(loading->scene), loading->import_begin_ns, now_ns());
    return true;
}

/* ---- frames ---- */

static void add_export(struct session *session, int64_t frame, uint64_t begin_ns)
{
    const uint64_t duration_ns = now_ns() - begin_ns;
    session->export_ns += duration_ns;
    cli_trace_span(session->trace, CLI_TRACE_CLIENT, "export", frame, begin_ns, duration_ns);
}

static bool export_frame(struct session *session, const struct fl_frame *frame, struct fl_error *error)
{
    const struct cli_job *job = session->job;
    if (session->is_series &&
        !fl_pattern_path(&session->pattern, frame->frame, session->path, sizeof session->path))
        return fl_error_set(error, FL_ERROR_FILE, job->output, "the path of frame %u is too long", frame->frame);
    const struct fl_export_options options = {.path = session->path,
                                              .format = cli_image_name(job->image),
                                              .half = !job->float_pixels && job->image == CLI_IMAGE_EXR,
                                              .quality = job->image == CLI_IMAGE_JPEG ? job->file_quality : 0};
    const uint64_t begin_ns = now_ns();
    const bool written = fl_exporter_write(session->exporter, frame, &options, error);
    add_export(session, frame->frame, begin_ns);
    return written;
}

static bool finish_export(struct session *session, struct fl_error *error)
{
    const uint64_t begin_ns = now_ns();
    const bool written = fl_exporter_wait(session->exporter, error) &&
                         (!session->to_stdout || cli_copy_to_stdout(session->path, error));
    add_export(session, -1, begin_ns);
    return written;
}

static bool take_frames(struct session *session, struct fl_error *error)
{
    const struct fl_job_options *options = &session->job->options;
    const uint32_t step = options->frame_step > 0 ? options->frame_step : 1;
    const uint32_t total = (options->last_frame - options->first_frame) / step + 1;
    struct fl_frame *frame = NULL;
    uint32_t done = 0;
    if (session->is_series)
        cli_progress_frames(&session->progress, 0, total);
    while ((frame = fl_render_next(session->rendering, error)) != NULL) {
        cli_trace_frame(session->trace, frame, now_ns());
        cli_timings_frame(session->timings, frame);
        const bool written = export_frame(session, frame, error);
        fl_frame_destroy(frame);
        if (!written)
            return false;
        /* The file before is complete by now; this one is being written. */
        if (session->is_series && done > 0)
            cli_progress_frames(&session->progress, done, total);
        done++;
    }
    if (error->code != FL_ERROR_NONE || !finish_export(session, error))
        return false;
    if (session->is_series)
        cli_progress_frames(&session->progress, total, total);
    return true;
}

static bool run(struct session *session, struct fl_error *error)
{
    struct cli_job *job = session->job;
    if (!prepare_output(session, error) || !load_scene(session, error) ||
        !cli_choose_camera(job, session->loading.scene, error))
        return false;
    session->rendering = fl_render_start(session->loading.scene, &job->options, error);
    return session->rendering != NULL && take_frames(session, error);
}

/* ---- end ---- */

static void print_timings(struct session *session)
{
    const struct cli_client_times times = {.total_ns = now_ns() - session->begin_ns,
                                           .start_ns = fl_connection_start_ns(session->loading.connection),
                                           .export_ns = session->export_ns,
                                           .import = fl_scene_import_stats(session->loading.scene)};
    cli_timings_end(session->timings, &times);
}

static void close_session(struct session *session)
{
    /* After an interruption the daemon is still told in order. */
    if (session->loading.connection != NULL)
        fl_connection_set_interrupt(session->loading.connection, 0);
    fl_render_destroy(session->rendering);
    fl_exporter_destroy(session->exporter);
    cli_loading_close(&session->loading);
    cli_timings_destroy(session->timings);
    if (session->temporary[0] != '\0') {
        unlink(session->path);
        rmdir(session->temporary);
    }
}

int cli_run_job(struct cli_job *job, bool is_series)
{
    struct session session = {.job = job, .is_series = is_series, .begin_ns = now_ns()};
    struct fl_error error = {0};
    if (!cli_interrupt_begin(&error))
        return cli_report(&error);
    session.loading = (struct cli_loading){.job = job, .progress = &session.progress};
    cli_progress_begin(&session.progress, job->quiet);
    if (job->timings != CLI_TIMINGS_NONE)
        session.timings = cli_timings_create(job->timings, strcmp(job->output, "-") == 0);
    bool done = begin_trace(&session, &error) && run(&session, &error);
    cli_progress_end(&session.progress, done);
    if (done)
        print_timings(&session);
    close_session(&session);
    cli_trace_span(session.trace, CLI_TRACE_COMMAND, is_series ? "animate" : "render", -1, session.begin_ns,
                   now_ns() - session.begin_ns);
    /* An interruption or failure before it is what the command ended for. */
    if (!cli_trace_file_destroy(session.trace, done ? &error : NULL))
        done = false;
    return done ? CLI_DONE : cli_report(&error);
}
