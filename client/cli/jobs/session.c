/* SPDX-License-Identifier: MIT */
/* A command that renders: loads the scene, fetches frames and writes them. After the loss of a daemon it
 * retries: the scene is loaded again, and the first unwritten frame is the next one. */
#include "session.h"
#include "protocol/common/clock.h"
#include "settle.h"
#include "timings.h"
#include "options/complete.h"
#include "options/image_path.h"
#include "options/interrupt.h"
#include "options/job.h"
#include "options/loading.h"
#include "options/models.h"
#include "options/progress.h"
#include "options/retry.h"
#include "options/talk.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define DEFAULT_RETRY_S 300

/* ---- beginning ---- */

static bool begin_trace(struct cli_session *session, struct fl_error *error)
{
    const struct cli_job *job = session->job;
    const char *const others[] = {job->input.model, job->input.environment, job->camera.keys_file};
    if (!job->talk.trace_file)
        return true;
    if (!cli_check_not_input(job->talk.trace_file, "--trace-file", others, 3, error))
        return false;
    session->trace = cli_trace_file_create(job->talk.trace_file, error);
    return session->trace != NULL;
}

static bool start_sinks(struct cli_session *session, struct fl_error *error)
{
    if (session->sinks_started)
        return true;
    session->sinks_started = true;
    session->sink_failed = !cli_sinks_start(&session->sinks, error);
    return !session->sink_failed;
}

/* Settles the options for a loaded scene. */
static bool settle(struct cli_session *session, struct fl_error *error)
{
    struct fl_scene *scene = session->loading.scene;
    session->job->options = session->typed;
    return (!session->job->input.watch || cli_watch_scene(&session->watch, scene, error)) &&
           cli_choose_camera(session->job, scene, error) &&
           cli_settle(session->job, scene, session->is_series, error) &&
           cli_sinks_names(&session->sinks, scene, error);
}

/* Seconds that remain for retries; without a number of attempts a duration is the limit. */
static double seconds_left(const struct cli_session *session)
{
    const struct cli_retries *retries = &session->job->daemon.retries;
    const double for_s = retries->has_duration ? retries->for_s : retries->has_count ? INFINITY : DEFAULT_RETRY_S;
    return for_s - (double)(monotonic_now_ns() - session->lost_ns) * 1e-9;
}

/* Timeout of a connection, at most the remaining time for retries; a private daemon has the default time to
 * start. */
static unsigned connect_timeout_ms(const struct cli_session *session)
{
    const struct cli_job *job = session->job;
    if (!job->daemon.server || (session->failures == 0 && !job->daemon.retries.has_duration))
        return 0;
    return cli_connect_timeout_ms(session->failures > 0 ? seconds_left(session) : job->daemon.retries.for_s);
}

/* Loads the scene. The importer loads its libraries while the daemon starts, and the exporter while the
 * importer runs: once the scene is loaded, the daemon uses all processors. */
static bool load_scene(struct cli_session *session, struct fl_error *error)
{
    struct cli_loading *loading = &session->loading;
    *loading = (struct cli_loading){.job = session->job,
                                    .progress = &session->progress,
                                    .again = session->was_loaded,
                                    .timeout_ms = connect_timeout_ms(session)};
    if (!cli_loading_begin(loading, error))
        return false;
    session->was_reached = true;
    cli_trace_span(session->trace, CLI_TRACE_CLIENT, "start", -1, loading->connect_begin_ns,
                   fl_connection_start_ns(loading->connection));
    if (!start_sinks(session, error) || !cli_loading_end(loading, error))
        return false;
    if (!session->job->input.scene)
        cli_trace_import(session->trace, fl_scene_import_stats(loading->scene), loading->import_begin_ns,
                         monotonic_now_ns());
    session->was_loaded = true;
    return settle(session, error);
}

/* ---- which frames ---- */

static bool is_there(void *user, uint32_t frame)
{
    struct cli_session *session = user;
    return cli_sinks_have(&session->sinks, frame);
}

static bool choose_frames(struct cli_session *session, struct fl_error *error)
{
    struct cli_job *job = session->job;
    const struct cli_series *series = &job->series;
    struct fl_frame_run wanted = {.step = 1};
    if (session->has_set)
        return true;
    session->has_set = true;
    if (session->is_series && series->shard_parts > 0 &&
        !(series->is_chunk ? fl_frame_run_chunk : fl_frame_run_shard)(&series->range, series->shard_part,
                                                                      series->shard_parts, &wanted)) {
        if (!job->talk.quiet)
            fprintf(stderr, "farlight: there are fewer frames than parts: part %u has none\n", series->shard_part);
        return true;
    }
    if (session->is_series && series->shard_parts == 0)
        wanted = series->range;
    if (!fl_frame_set_missing(&wanted, series->resume ? is_there : NULL, session, &session->set, error))
        return false;
    const uint32_t there = fl_frame_run_count(&wanted) - session->set.frame_count;
    if (series->resume && !job->talk.quiet && there > 0)
        fprintf(stderr, "farlight: %u of %u frames exist already\n", there, fl_frame_run_count(&wanted));
    return true;
}

/* ---- lost daemons ---- */

static void close_connection(struct cli_session *session)
{
    /* The daemon gets an orderly goodbye, also after an interruption. */
    if (session->loading.connection)
        fl_connection_set_interrupt(session->loading.connection, 0);
    fl_render_destroy(session->rendering);
    session->rendering = NULL;
    cli_loading_close(&session->loading);
}

/* True if the error may pass. If no daemon has answered yet, the address may be misspelt: the command then
 * retries only on request. */
static bool may_be_retried(const struct cli_session *session, const struct fl_error *error)
{
    const struct cli_job *job = session->job;
    return !session->sink_failed && cli_is_temporary(error) &&
           (session->was_reached || error->retryable || job->daemon.retries.has_duration);
}

/* Waits, longer each time, within the remaining time. False: interrupted. */
static bool pause_before_retry(const struct cli_session *session, uint32_t min_ms, struct fl_error *error)
{
    const double left_s = fmax(seconds_left(session), 0); /* closing the connection may have used up the rest */
    uint32_t pause_ms = cli_retry_pause_ms(session->failures, min_ms);
    if (pause_ms * 1e-3 > left_s)
        pause_ms = (uint32_t)(left_s * 1e3) + 1;
    if (!session->job->talk.quiet) {
        fprintf(stderr, "farlight: trying again in %.1f s", pause_ms * 1e-3);
        if (session->job->daemon.retries.has_count)
            fprintf(stderr, " (%u of %u)", session->failures, session->job->daemon.retries.count);
        if (isfinite(left_s))
            fprintf(stderr, ", for at most %.0f s more", left_s);
        if (session->is_series && session->has_set)
            fprintf(stderr, "; %u of %u frames are written", session->done, session->set.frame_count);
        fputc('\n', stderr);
    }
    return cli_retry_wait(pause_ms, error);
}

/* Reports the error; true: the session continues. */
static bool recover(struct cli_session *session, struct fl_error *error)
{
    const struct cli_retries *retries = &session->job->daemon.retries;
    if (!may_be_retried(session, error))
        return false;
    if (session->failures == 0) /* a daemon that never answers counts as lost from the beginning of the attempt */
        session->lost_ns = session->loading.connection ? monotonic_now_ns() : session->loading.connect_begin_ns;
    if ((retries->has_count && session->failures >= retries->count) || seconds_left(session) <= 0) {
        if (session->failures > 0 && !session->job->talk.quiet)
            fprintf(stderr, "farlight: given up after %u attempt%s in %.0f s\n", session->failures,
                    session->failures == 1 ? "" : "s", (double)(monotonic_now_ns() - session->lost_ns) * 1e-9);
        return false;
    }
    session->failures++;
    cli_progress_clear(&session->progress);
    cli_report(error);
    close_connection(session);
    if (session->job->sampling.progressive)
        session->begun = false; /* its samples are lost with the daemon */
    return pause_before_retry(session, error->retry_after_ms, error);
}

static bool load_and_render(struct cli_session *session, struct fl_error *error)
{
    while (!load_scene(session, error) || !choose_frames(session, error) || !session_render(session, error))
        if (!recover(session, error))
            return false;
    /* A private daemon ends while the last file is written. */
    if (!session->job->daemon.server && !session->job->input.watch)
        fl_connection_end(session->loading.connection);
    return session_finish_sinks(session, error);
}

/* ---- changed files ---- */

static bool begin_watch(struct cli_session *session, struct fl_error *error)
{
    const struct cli_job *job = session->job;
    return !job->input.watch || cli_watch_begin_models(&session->watch, job->input.models, job->input.count,
                                                       job->input.environment, error);
}

static bool render_again(struct cli_session *session, struct fl_error *error)
{
    session->begun = false;
    session->run = 0;
    session->done = 0;
    return cli_loading_again(&session->loading, error) && settle(session, error) &&
           session_render(session, error) && session_finish_sinks(session, error);
}

/* Renders again after changes, until an interruption, which is the normal end. An unreadable model is reported,
 * and its last picture stays. */
static bool follow(struct cli_session *session, struct fl_error *error)
{
    if (!session->job->talk.quiet)
        fprintf(stderr, "farlight: watching %zu files; Ctrl-C ends it\n", session->watch.count);
    while (cli_watch_wait(&session->watch, session->loading.connection, error)) {
        if (render_again(session, error)) {
            cli_progress_clear(&session->progress);
            cli_loading_print_sent(&session->loading, session->job->output.list[0].path);
            continue;
        }
        if (error->code == FL_ERROR_INTERRUPTED || session->sink_failed ||
            (cli_is_temporary(error) && !(recover(session, error) && load_and_render(session, error))))
            break;
        fl_render_destroy(session->rendering);
        session->rendering = NULL;
        cli_progress_clear(&session->progress);
        if (error->code != FL_ERROR_NONE)
            cli_report(error);
        *error = (struct fl_error){0};
    }
    if (error->code == FL_ERROR_INTERRUPTED)
        *error = (struct fl_error){0};
    return error->code == FL_ERROR_NONE;
}

static bool run(struct cli_session *session, struct fl_error *error)
{
    if (!cli_sinks_prepare(&session->sinks, session->job, session->is_series, error))
        return false;
    /* Without frames to render, no daemon is needed. */
    if (session->is_series && session->job->series.has_range && !choose_frames(session, error))
        return false;
    if (session->has_set && session->set.frame_count == 0)
        return true;
    if (!begin_watch(session, error) || !load_and_render(session, error))
        return false;
    session_show_progress(session);
    return !session->job->input.watch || follow(session, error);
}

/* ---- end ---- */

static void print_timings(struct cli_session *session)
{
    const struct cli_client_times times = {.total_ns = monotonic_now_ns() - session->begin_ns,
                                           .start_ns = fl_connection_start_ns(session->loading.connection),
                                           .export_ns = session->export_ns,
                                           .import = fl_scene_import_stats(session->loading.scene)};
    cli_timings_end(session->timings, &times);
}

static void close_session(struct cli_session *session)
{
    close_connection(session);
    cli_watch_end(&session->watch);
    cli_sinks_close(&session->sinks);
    fl_frame_set_finish(&session->set);
    cli_picture_part_finish(&session->part);
    cli_timings_destroy(session->timings);
}

int cli_run_job(struct cli_job *job, bool is_series)
{
    struct cli_session session = {
        .job = job, .is_series = is_series, .typed = job->options, .begin_ns = monotonic_now_ns()};
    struct fl_error error = {0};
    if (!cli_interrupt_begin(&error))
        return cli_report(&error);
    cli_progress_begin(&session.progress, &job->talk);
    if (job->talk.timings != CLI_TIMINGS_NONE)
        session.timings = cli_timings_create(job->talk.timings, cli_writes_to_stdout(job));
    bool done = cli_read_input(job, &error) && begin_trace(&session, &error) && run(&session, &error);
    cli_progress_end(&session.progress, done);
    if (done && session.was_loaded)
        print_timings(&session);
    close_session(&session);
    cli_trace_span(session.trace, CLI_TRACE_COMMAND, is_series ? "animate" : "render", -1, session.begin_ns,
                   monotonic_now_ns() - session.begin_ns);
    /* An earlier interruption or failure is the command's result. */
    if (!cli_trace_file_destroy(session.trace, done ? &error : NULL))
        done = false;
    return done ? CLI_DONE : cli_report(&error);
}

int cli_dry_run(struct cli_job *job)
{
    struct cli_session session = {.job = job, .is_series = true};
    struct fl_error error = {0};
    const bool done = cli_check_models(job, &error) && cli_sinks_prepare(&session.sinks, job, true, &error) &&
                      (!job->series.has_range || choose_frames(&session, &error));
    if (done && session.has_set)
        printf("%u frame%s would be rendered\n", session.set.frame_count, session.set.frame_count == 1 ? "" : "s");
    else if (done)
        puts("the number of frames depends on the model");
    cli_sinks_close(&session.sinks);
    fl_frame_set_finish(&session.set);
    return done ? CLI_DONE : cli_report(&error);
}
