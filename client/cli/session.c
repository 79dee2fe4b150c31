/* SPDX-License-Identifier: MIT */
/* From a model to pictures: loads the scene, fetches frames and writes them. A lost daemon is waited for: the
 * scene is loaded again, and the first unwritten frame is the next one. */
#include "cli/sink.h"
#include "cli/trace_file.h"
#include "cli/watch.h"
#include "protocol/common/clock.h"
#include "protocol/plain_text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define ERROR_PASS_SAMPLES 16u /* fewer have no error yet */
#define LONG_PASS_NS 1000000000u
#define DEFAULT_RETRY_S 300
#define PASS_SAMPLES_MAX 65536u /* of one request, in the protocol */

struct session {
    struct cli_job *job;
    bool is_series;
    struct cli_sinks sinks;
    bool sinks_started, sink_failed;
    struct cli_loading loading;
    struct cli_watch watch;
    struct message_render typed; /* the job's options before a scene has settled them */
    struct fl_job *rendering;
    bool was_reached, was_loaded; /* the daemon, once at least; likewise, and it has accepted the scene */
    bool has_set;                 /* which frames are wanted is known */
    struct fl_frame_set set;
    size_t run;        /* the current one of the set */
    bool begun;        /* of this run a frame has been written */
    uint64_t next;     /* once begun: its first frame that has not */
    float noise;       /* of the last frame that has come */
    uint32_t done;     /* frames written */
    unsigned failures; /* lost connections since the last frame */
    uint64_t lost_ns;  /* when the first of them was lost */
    struct cli_warned warned;
    struct cli_timings *timings;
    struct cli_trace_file *trace; /* NULL: none is wanted */
    struct cli_progress progress;
    bool is_being_written; /* a picture of a series: */
    uint32_t written_frame;
    uint64_t frame_ns;      /* when the picture before it had come */
    double written_seconds; /* from then until it had */
    char written_path[4352];
    uint32_t written_samples; /* of a pixel */
    uint64_t begin_ns, export_ns;
};

/* ---- beginning ---- */

static bool begin_trace(struct session *session, struct fl_error *error)
{
    const struct cli_job *job = session->job;
    const char *const others[] = {job->model, job->environment, job->keys_file};
    if (!job->trace_file)
        return true;
    if (!cli_check_not_input(job->trace_file, "--trace-file", others, 3, error))
        return false;
    session->trace = cli_trace_file_create(job->trace_file, error);
    return session->trace != NULL;
}

static bool start_sinks(struct session *session, struct fl_error *error)
{
    if (session->sinks_started)
        return true;
    session->sinks_started = true;
    session->sink_failed = !cli_sinks_start(&session->sinks, error);
    return !session->sink_failed;
}

/* Of a scene that has been loaded. */
static bool settle(struct session *session, struct fl_error *error)
{
    struct fl_scene *scene = session->loading.scene;
    session->job->options = session->typed;
    return (!session->job->watch || cli_watch_scene(&session->watch, scene, error)) &&
           cli_choose_camera(session->job, scene, error) &&
           cli_settle(session->job, scene, session->is_series, error) &&
           cli_sinks_names(&session->sinks, scene, error);
}

/* Without a number of attempts a duration is the limit. */
static double seconds_left(const struct session *session)
{
    const struct cli_retries *retries = &session->job->retries;
    const double for_s = retries->has_duration ? retries->for_s : retries->has_count ? INFINITY : DEFAULT_RETRY_S;
    return for_s - (double)(monotonic_now_ns() - session->lost_ns) * 1e-9;
}

/* A daemon that does not answer takes no longer than it is to be tried; one of our own has its time to start. */
static unsigned connect_timeout_ms(const struct session *session)
{
    const struct cli_job *job = session->job;
    if (!job->server || (session->failures == 0 && !job->retries.has_duration))
        return 0;
    return cli_connect_timeout_ms(session->failures > 0 ? seconds_left(session) : job->retries.for_s);
}

/* The importer loads its libraries while the daemon starts, and the exporter while the importer runs: once the
 * scene is loaded the daemon uses all processors. */
static bool load_scene(struct session *session, struct fl_error *error)
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
    if (!session->job->scene)
        cli_trace_import(session->trace, fl_scene_import_stats(loading->scene), loading->import_begin_ns,
                         monotonic_now_ns());
    session->was_loaded = true;
    return settle(session, error);
}

/* ---- which frames ---- */

static bool is_there(void *user, uint32_t frame)
{
    struct session *session = user;
    return cli_sinks_have(&session->sinks, frame);
}

static bool choose_frames(struct session *session, struct fl_error *error)
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
        if (!job->quiet)
            fprintf(stderr, "farlight: there are fewer frames than parts: part %u has none\n", series->shard_part);
        return true;
    }
    if (session->is_series && series->shard_parts == 0)
        wanted = series->range;
    if (!fl_frame_set_missing(&wanted, series->resume ? is_there : NULL, session, &session->set, error))
        return false;
    const uint32_t there = fl_frame_run_count(&wanted) - session->set.frame_count;
    if (series->resume && !job->quiet && there > 0)
        fprintf(stderr, "farlight: %u of %u frames exist already\n", there, fl_frame_run_count(&wanted));
    return true;
}

/* ---- frames ---- */

static void add_export(struct session *session, int64_t frame, uint64_t begin_ns)
{
    const uint64_t duration_ns = monotonic_now_ns() - begin_ns;
    session->export_ns += duration_ns;
    cli_trace_span(session->trace, CLI_TRACE_CLIENT, "export", frame, begin_ns, duration_ns);
}

static bool is_enough(const struct session *session, float noise, uint32_t samples)
{
    const struct message_render *options = &session->job->options;
    return noise <= options->noise || samples >= options->samples;
}

/* Whether it is more than a step on the way to a picture. */
static bool is_wanted(const struct session *session, const struct fl_frame *frame)
{
    const struct cli_job *job = session->job;
    return job->progressive || !job->by_error || is_enough(session, frame->noise, frame->samples);
}

static bool write_frame(struct session *session, const struct fl_frame *frame, struct fl_error *error)
{
    const uint64_t begin_ns = monotonic_now_ns();
    cli_trace_frame(session->trace, frame, begin_ns);
    cli_timings_frame(session->timings, frame);
    cli_structure_warn(frame, &session->warned, &session->progress);
    const bool written = !is_wanted(session, frame) || cli_sinks_write(&session->sinks, frame, error);
    add_export(session, frame->frame, begin_ns);
    session->sink_failed = !written;
    return written;
}

/* The picture that was being written is complete: another one is, or the sinks are finished. */
static void log_frame(struct session *session)
{
    if (session->is_being_written)
        cli_progress_frame(&session->progress, session->written_frame, session->written_seconds,
                           session->written_path);
    session->is_being_written = false;
}

static void note_frame(struct session *session, const struct fl_frame *frame)
{
    const uint64_t now_ns = monotonic_now_ns();
    log_frame(session);
    session->is_being_written = session->is_series;
    session->written_frame = frame->frame;
    session->written_seconds =
        (double)(now_ns - (session->frame_ns > 0 ? session->frame_ns : session->begin_ns)) * 1e-9;
    session->frame_ns = now_ns;
    cli_sinks_path(&session->sinks, session->written_path, sizeof(session->written_path));
}

static bool finish_sinks(struct session *session, struct fl_error *error)
{
    const uint64_t begin_ns = monotonic_now_ns();
    session->sink_failed = !cli_sinks_finish(&session->sinks, error);
    add_export(session, -1, begin_ns);
    if (!session->sink_failed)
        log_frame(session);
    return !session->sink_failed;
}

static void show_progress(struct session *session)
{
    if (session->is_series)
        cli_progress_frames(&session->progress, session->done, session->set.frame_count);
}

static bool take_frames(struct session *session, const struct fl_frame_run *run, struct fl_error *error)
{
    struct fl_frame *frame = NULL;
    while ((frame = fl_render_next(session->rendering, error))) {
        const uint64_t next = (uint64_t)frame->frame + run->step;
        const bool written = write_frame(session, frame, error), wanted = is_wanted(session, frame);
        session->noise = frame->noise;
        session->failures = 0;
        if (written && wanted) {
            session->written_samples = frame->samples;
            note_frame(session, frame);
        }
        fl_frame_destroy(frame);
        if (!written)
            return false;
        if (!wanted)
            continue;
        /* The previous file is complete; this one is being written. */
        if (session->done > 0)
            show_progress(session);
        session->next = next;
        session->begun = true;
        session->done++;
    }
    return error->code == FL_ERROR_NONE;
}

/* The samples of the next pass: if it is not given, the number so far, so that little time is spent on writing
 * files; without an end, no more than before once a pass takes long, so that the picture keeps changing. */
static uint32_t pass_samples(const struct cli_job *job, uint32_t held, uint32_t total, uint32_t last,
                             uint64_t last_ns)
{
    const uint32_t first = job->by_error && !job->progressive ? ERROR_PASS_SAMPLES : 1;
    uint32_t samples = job->pass_samples > 0 ? job->pass_samples : held > 0 ? held : first;
    if ((job->endless || job->by_error) && job->pass_samples == 0 && last_ns > LONG_PASS_NS)
        samples = last;
    samples = samples < PASS_SAMPLES_MAX ? samples : PASS_SAMPLES_MAX;
    return samples < total - held ? samples : total - held;
}

static void print_held(const char *path, uint32_t held)
{
    fputs("farlight: ", stderr);
    plain_text_print(stderr, path);
    fprintf(stderr, " has %u sample%s a pixel\n", held, held == 1 ? "" : "s");
}

/* After an interruption: completes the file that is being written. False: the interruption is an error. */
static bool end_passes(struct session *session, struct fl_error *error)
{
    const struct cli_job *job = session->job;
    struct fl_error failure = {0};
    if (error->code != FL_ERROR_INTERRUPTED || session->written_samples == 0 || !job->progressive)
        return false;
    if (!finish_sinks(session, &failure)) {
        *error = failure;
        return false;
    }
    cli_progress_clear(&session->progress);
    if (!job->quiet)
        print_held(job->outputs[0].path, session->written_samples);
    if (job->endless)
        *error = (struct fl_error){0};
    return job->endless;
}

/* A progressive picture, or one that is sampled by its error: one job per pass, whose samples the daemon adds to
 * the previous ones. */
static bool render_passes(struct session *session, struct fl_error *error)
{
    const struct cli_job *job = session->job;
    struct message_render options = job->options;
    const uint32_t total = job->endless ? UINT32_MAX : options.samples;
    const struct fl_frame_run still = {.step = 1};
    uint64_t pass_ns = 0;
    options.accumulate = PROTOCOL_ACCUMULATION_ON;
    for (uint32_t held = 0; held < total; held += options.samples) {
        const uint64_t begin_ns = monotonic_now_ns();
        options.samples = pass_samples(job, held, total, options.samples, pass_ns);
        session->rendering = fl_render_start(session->loading.scene, &options, error);
        if (!session->rendering || !take_frames(session, &still, error))
            return end_passes(session, error);
        fl_render_destroy(session->rendering);
        session->rendering = NULL;
        pass_ns = monotonic_now_ns() - begin_ns;
        if (!job->by_error) {
            cli_progress_samples(&session->progress, held + options.samples, job->endless ? 0 : total);
            continue;
        }
        cli_progress_noise(&session->progress, &(struct cli_noise){.error = session->noise,
                                                                   .wanted = options.noise,
                                                                   .held = held + options.samples,
                                                                   .total = total});
        if (is_enough(session, session->noise, 0))
            break;
    }
    return true;
}

/* What is left of one run, as one job. */
static bool render_run(struct session *session, const struct fl_frame_run *run, struct fl_error *error)
{
    struct message_render options = session->job->options;
    if (session->job->progressive || session->job->by_error)
        return render_passes(session, error);
    options.first_frame = session->begun ? (uint32_t)session->next : run->first;
    options.last_frame = run->last;
    options.frame_step = run->step;
    session->rendering = fl_render_start(session->loading.scene, &options, error);
    const bool done = session->rendering && take_frames(session, run, error);
    if (done) {
        fl_render_destroy(session->rendering);
        session->rendering = NULL;
    }
    return done;
}

static bool render(struct session *session, struct fl_error *error)
{
    const struct fl_frame_set *set = &session->set;
    show_progress(session);
    for (; session->run < set->run_count; session->run++, session->begun = false) {
        const struct fl_frame_run *run = &set->runs[session->run];
        if ((!session->begun || session->next <= run->last) && !render_run(session, run, error))
            return false;
    }
    return true;
}

/* ---- lost daemons ---- */

static void close_connection(struct session *session)
{
    /* After an interruption the daemon still gets a proper end. */
    if (session->loading.connection)
        fl_connection_set_interrupt(session->loading.connection, 0);
    fl_render_destroy(session->rendering);
    session->rendering = NULL;
    cli_loading_close(&session->loading);
}

/* Where no daemon has answered yet, the address may be misspelt: the command waits only if that was asked for. */
static bool may_be_retried(const struct session *session, const struct fl_error *error)
{
    const struct cli_job *job = session->job;
    return !session->sink_failed && cli_is_temporary(error) &&
           (session->was_reached || error->retryable || job->retries.has_duration);
}

/* Longer each time, and no longer than is left. False: interrupted. */
static bool pause_before_retry(const struct session *session, uint32_t min_ms, struct fl_error *error)
{
    const double left_s = fmax(seconds_left(session), 0); /* closing the connection may have taken the rest */
    uint32_t pause_ms = cli_retry_pause_ms(session->failures, min_ms);
    if (pause_ms * 1e-3 > left_s)
        pause_ms = (uint32_t)(left_s * 1e3) + 1;
    if (!session->job->quiet) {
        fprintf(stderr, "farlight: trying again in %.1f s", pause_ms * 1e-3);
        if (session->job->retries.has_count)
            fprintf(stderr, " (%u of %u)", session->failures, session->job->retries.count);
        if (isfinite(left_s))
            fprintf(stderr, ", for at most %.0f s more", left_s);
        if (session->is_series && session->has_set)
            fprintf(stderr, "; %u of %u frames are written", session->done, session->set.frame_count);
        fputc('\n', stderr);
    }
    return cli_retry_wait(pause_ms, error);
}

/* Reports the error; true: the session continues after it. */
static bool recover(struct session *session, struct fl_error *error)
{
    const struct cli_retries *retries = &session->job->retries;
    if (!may_be_retried(session, error))
        return false;
    if (session->failures == 0) /* a daemon that does not answer is lost from the beginning of the attempt */
        session->lost_ns = session->loading.connection ? monotonic_now_ns() : session->loading.connect_begin_ns;
    if ((retries->has_count && session->failures >= retries->count) || seconds_left(session) <= 0) {
        if (session->failures > 0 && !session->job->quiet)
            fprintf(stderr, "farlight: given up after %u attempt%s in %.0f s\n", session->failures,
                    session->failures == 1 ? "" : "s", (double)(monotonic_now_ns() - session->lost_ns) * 1e-9);
        return false;
    }
    session->failures++;
    cli_progress_clear(&session->progress);
    cli_report(error);
    close_connection(session);
    if (session->job->progressive)
        session->begun = false; /* its samples are lost with the daemon */
    return pause_before_retry(session, error->retry_after_ms, error);
}

static bool load_and_render(struct session *session, struct fl_error *error)
{
    while (!load_scene(session, error) || !choose_frames(session, error) || !render(session, error))
        if (!recover(session, error))
            return false;
    /* What a private daemon takes to end it takes while the last file is written. */
    if (!session->job->server && !session->job->watch)
        fl_connection_end(session->loading.connection);
    return finish_sinks(session, error);
}

/* ---- changed files ---- */

static bool begin_watch(struct session *session, struct fl_error *error)
{
    const struct cli_job *job = session->job;
    return !job->watch ||
           cli_watch_begin_models(&session->watch, job->models, job->model_count, job->environment, error);
}

static bool render_again(struct session *session, struct fl_error *error)
{
    session->begun = false;
    session->run = 0;
    session->done = 0;
    return cli_loading_again(&session->loading, error) && settle(session, error) && render(session, error) &&
           finish_sinks(session, error);
}

/* Until it is interrupted, which is its end. A model that cannot be read is reported, and its last picture stays.
 */
static bool follow(struct session *session, struct fl_error *error)
{
    if (!session->job->quiet)
        fprintf(stderr, "farlight: watching %zu files; Ctrl-C ends it\n", session->watch.count);
    while (cli_watch_wait(&session->watch, session->loading.connection, error)) {
        if (render_again(session, error)) {
            cli_progress_clear(&session->progress);
            cli_loading_print_sent(&session->loading, session->job->outputs[0].path);
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

static bool run(struct session *session, struct fl_error *error)
{
    if (!cli_sinks_prepare(&session->sinks, session->job, session->is_series, error))
        return false;
    /* Nothing left to do needs no daemon. */
    if (session->is_series && session->job->series.has_range && !choose_frames(session, error))
        return false;
    if (session->has_set && session->set.frame_count == 0)
        return true;
    if (!begin_watch(session, error) || !load_and_render(session, error))
        return false;
    show_progress(session);
    return !session->job->watch || follow(session, error);
}

/* ---- end ---- */

static void print_timings(struct session *session)
{
    const struct cli_client_times times = {.total_ns = monotonic_now_ns() - session->begin_ns,
                                           .start_ns = fl_connection_start_ns(session->loading.connection),
                                           .export_ns = session->export_ns,
                                           .import = fl_scene_import_stats(session->loading.scene)};
    cli_timings_end(session->timings, &times);
}

static void close_session(struct session *session)
{
    close_connection(session);
    cli_watch_end(&session->watch);
    cli_sinks_close(&session->sinks);
    fl_frame_set_finish(&session->set);
    cli_timings_destroy(session->timings);
}

int cli_run_job(struct cli_job *job, bool is_series)
{
    struct session session = {
        .job = job, .is_series = is_series, .typed = job->options, .begin_ns = monotonic_now_ns()};
    struct fl_error error = {0};
    if (!cli_interrupt_begin(&error))
        return cli_report(&error);
    cli_progress_begin(&session.progress, job);
    if (job->timings != CLI_TIMINGS_NONE)
        session.timings = cli_timings_create(job->timings, cli_writes_to_stdout(job));
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
    struct session session = {.job = job, .is_series = true};
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
