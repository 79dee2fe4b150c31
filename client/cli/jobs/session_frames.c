/* SPDX-License-Identifier: MIT */
/* Frames of a session: jobs, passes of a refined picture, squares of a part, and their files. */
#include "session.h"
#include "protocol/common/clock.h"
#include "protocol/plain_text.h"
#include "picture_part.h"
#include "sink.h"
#include "structure.h"
#include "timings.h"
#include "trace_file.h"
#include "options/job.h"
#include "options/progress.h"

#include <stdio.h>
#include <string.h>

#define ERROR_PASS_SAMPLES 16u /* fewer samples have no error estimate */
#define LONG_PASS_NS 1000000000u
#define PASS_SAMPLES_MAX 65536u /* the protocol's limit of a request */

static void add_export(struct cli_session *session, int64_t frame, uint64_t begin_ns)
{
    const uint64_t duration_ns = monotonic_now_ns() - begin_ns;
    session->export_ns += duration_ns;
    cli_trace_span(session->trace, CLI_TRACE_CLIENT, "export", frame, begin_ns, duration_ns);
}

static bool is_enough(const struct cli_session *session, float noise, uint32_t samples)
{
    const struct message_render *options = &session->job->options;
    return noise <= options->sampling.noise || samples >= options->sampling.samples;
}

/* True for a frame that has to be written, not a step on the way to a picture. */
static bool is_wanted(const struct cli_session *session, const struct fl_frame *frame)
{
    const struct cli_job *job = session->job;
    return job->sampling.progressive || !job->sampling.by_error ||
           is_enough(session, frame->noise, frame->samples);
}

static void report_frame(struct cli_session *session, const struct fl_frame *frame)
{
    cli_trace_frame(session->trace, frame, monotonic_now_ns());
    cli_timings_frame(session->timings, frame);
    cli_structure_warn(frame, &session->warned, &session->progress);
}

static bool write_frame(struct cli_session *session, const struct fl_frame *frame, struct fl_error *error)
{
    const uint64_t begin_ns = monotonic_now_ns();
    const bool written = !is_wanted(session, frame) || cli_sinks_write(&session->sinks, frame, error);
    add_export(session, frame->frame, begin_ns);
    session->sink_failed = !written;
    return written;
}

/* Logs the picture that was being written, which is complete: another one is being written, or the sinks are
 * finished. */
static void log_frame(struct cli_session *session)
{
    if (session->is_being_written)
        cli_progress_frame(&session->progress, session->written_frame, session->written_seconds,
                           session->written_path);
    session->is_being_written = false;
}

static void note_frame(struct cli_session *session, const struct fl_frame *frame)
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

bool session_finish_sinks(struct cli_session *session, struct fl_error *error)
{
    const uint64_t begin_ns = monotonic_now_ns();
    session->sink_failed = !cli_sinks_finish(&session->sinks, error);
    add_export(session, -1, begin_ns);
    if (!session->sink_failed)
        log_frame(session);
    return !session->sink_failed;
}

void session_show_progress(struct cli_session *session)
{
    if (session->is_series)
        cli_progress_frames(&session->progress, session->done, session->set.frame_count);
}

static bool take_frames(struct cli_session *session, const struct fl_frame_run *run, struct fl_error *error)
{
    struct fl_frame *frame = NULL;
    while ((frame = fl_render_next(session->rendering, error))) {
        const uint64_t next = (uint64_t)frame->frame + run->step;
        report_frame(session, frame);
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
            session_show_progress(session);
        session->next = next;
        session->begun = true;
        session->done++;
    }
    return error->code == FL_ERROR_NONE;
}

/* Number of samples of the next pass: by default the number so far, so that little time is spent on writing
 * files; for an endless picture no more than in the last pass if that took long, so that the picture keeps
 * changing. */
static uint32_t pass_samples(const struct cli_job *job, uint32_t held, uint32_t total, uint32_t last,
                             uint64_t last_ns)
{
    const uint32_t first = job->sampling.by_error && !job->sampling.progressive ? ERROR_PASS_SAMPLES : 1;
    uint32_t samples = job->sampling.pass_samples > 0 ? job->sampling.pass_samples : held > 0 ? held : first;
    if ((job->sampling.endless || job->sampling.by_error) && job->sampling.pass_samples == 0 &&
        last_ns > LONG_PASS_NS)
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

/* Completes the file that is being written after an interruption. False: the interruption is an error. */
static bool end_passes(struct cli_session *session, struct fl_error *error)
{
    const struct cli_job *job = session->job;
    struct fl_error failure = {0};
    if (error->code != FL_ERROR_INTERRUPTED || session->written_samples == 0 || !job->sampling.progressive)
        return false;
    if (!session_finish_sinks(session, &failure)) {
        *error = failure;
        return false;
    }
    cli_progress_clear(&session->progress);
    if (!job->talk.quiet)
        print_held(job->output.list[0].path, session->written_samples);
    if (job->sampling.endless)
        *error = (struct fl_error){0};
    return job->sampling.endless;
}

/* Renders a progressive picture, or one that is sampled by its error: a job for each pass, whose samples the
 * daemon adds to the previous ones. */
static bool render_passes(struct cli_session *session, struct fl_error *error)
{
    const struct cli_job *job = session->job;
    struct message_render options = job->options;
    const uint32_t total = job->sampling.endless ? UINT32_MAX : options.sampling.samples;
    const struct fl_frame_run still = {.step = 1};
    uint64_t pass_ns = 0;
    options.sampling.accumulate = PROTOCOL_ACCUMULATION_ON;
    for (uint32_t held = 0; held < total; held += options.sampling.samples) {
        const uint64_t begin_ns = monotonic_now_ns();
        options.sampling.samples = pass_samples(job, held, total, options.sampling.samples, pass_ns);
        session->rendering = fl_render_start(session->loading.scene, &options, error);
        if (!session->rendering || !take_frames(session, &still, error))
            return end_passes(session, error);
        fl_render_destroy(session->rendering);
        session->rendering = NULL;
        pass_ns = monotonic_now_ns() - begin_ns;
        if (!job->sampling.by_error) {
            cli_progress_samples(&session->progress, held + options.sampling.samples,
                                 job->sampling.endless ? 0 : total);
            continue;
        }
        cli_progress_noise(&session->progress, &(struct cli_noise){.error = session->noise,
                                                                   .wanted = options.sampling.noise,
                                                                   .held = held + options.sampling.samples,
                                                                   .total = total});
        if (is_enough(session, session->noise, 0))
            break;
    }
    return true;
}

/* Renders the missing squares of a part, with a job for each; its file is written once, with all squares. */
static bool render_part(struct cli_session *session, struct fl_error *error)
{
    struct cli_job *job = session->job;
    struct cli_picture_part *part = &session->part;
    struct message_render options = job->options;
    struct fl_frame *frame = NULL;
    if (!cli_picture_part_begin(part, job, session->loading.connection, session->loading.scene, error))
        return false;
    if (job->series.resume && cli_picture_part_is_there(part, session->sinks.items[0].path)) {
        if (!job->talk.quiet)
            fprintf(stderr, "farlight: part %u of %u exists already\n", job->part.number, job->part.count);
        return true;
    }
    while (cli_picture_part_next(part, &options)) {
        session->rendering = fl_render_start(session->loading.scene, &options, error);
        while (session->rendering && (frame = fl_render_next(session->rendering, error))) {
            report_frame(session, frame);
            const bool taken = cli_picture_part_take(part, frame, error);
            fl_frame_destroy(frame);
            if (!taken)
                return false;
        }
        if (error->code != FL_ERROR_NONE)
            return false;
        fl_render_destroy(session->rendering);
        session->rendering = NULL;
        session->failures = 0;
        cli_progress_step(&session->progress, part->next - part->first, part->end - part->first,
                          "squares of the part");
    }
    return write_frame(session, part->frame, error);
}

/* Renders the rest of a run, as one job. */
static bool render_run(struct cli_session *session, const struct fl_frame_run *run, struct fl_error *error)
{
    struct message_render options = session->job->options;
    if (session->job->part.count > 0)
        return render_part(session, error);
    if (session->job->sampling.progressive || session->job->sampling.by_error)
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

bool session_render(struct cli_session *session, struct fl_error *error)
{
    const struct fl_frame_set *set = &session->set;
    session_show_progress(session);
    for (; session->run < set->run_count; session->run++, session->begun = false) {
        const struct fl_frame_run *run = &set->runs[session->run];
        if ((!session->begun || session->next <= run->last) && !render_run(session, run, error))
            return false;
    }
    return true;
}
