/* SPDX-License-Identifier: MIT */
/* Writing of trace files. */
#include "trace_file.h"

#include "protocol/common/trace_event.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct cli_trace_file {
    FILE *out;
    const char *path;
    int failure; /* errno of the first write that failed; 0: none */
    uint64_t threads;
    struct trace_writer writer;
    struct trace_track tracks[CLI_TRACE_TRACK_COUNT];
};

static const struct {
    uint64_t process;
    const char *name;
} tracks[CLI_TRACE_TRACK_COUNT] = {
    [CLI_TRACE_COMMAND] = {1, "command"},    [CLI_TRACE_CLIENT] = {1, "client"},
    [CLI_TRACE_IMPORTER] = {1, "importer"},  [CLI_TRACE_RENDER] = {2, "render, CPU"},
    [CLI_TRACE_OUTPUT] = {2, "output, CPU"}, [CLI_TRACE_GPU] = {2, "render, GPU"},
};

/* Flushes, so that the file can be read while the command runs, and survives a crash. */
static void flush(struct cli_trace_file *file)
{
    if (fflush(file->out) != 0 && file->failure == 0)
        file->failure = errno;
}

/* ---- events ---- */

static void put(struct cli_trace_file *file, enum cli_trace_track track, struct trace_event event)
{
    event.gpu = track == CLI_TRACE_GPU;
    event.process = tracks[track].process;
    trace_place_event(&file->writer, &file->tracks[track], tracks[track].name, &event);
    trace_write_event(&file->writer, &event);
}

void cli_trace_span(struct cli_trace_file *file, enum cli_trace_track track, const char *name, int64_t frame,
                    uint64_t start_ns, uint64_t duration_ns)
{
    struct trace_event event = {.name = name, .start_ns = start_ns, .duration_ns = duration_ns};
    if (!file)
        return;
    if (frame >= 0)
        event.arguments[0] = (struct trace_argument){"frame", (uint64_t)frame};
    put(file, track, event);
}

/* ---- frames ---- */

static enum cli_trace_track track_of(enum protocol_stage stage, bool gpu)
{
    if (gpu)
        return CLI_TRACE_GPU;
    return stage == PROTOCOL_STAGE_ENCODE || stage == PROTOCOL_STAGE_QUEUE || stage == PROTOCOL_STAGE_SEND
               ? CLI_TRACE_OUTPUT
               : CLI_TRACE_RENDER;
}

static void put_stages(struct cli_trace_file *file, const struct fl_frame *frame, uint64_t arrival_ns)
{
    struct trace_event *events = calloc(frame->stage_count + 1, sizeof(*events));
    uint64_t last_ns = 0;
    size_t count = 0;
    if (!events)
        return;
    for (size_t i = 0; i < frame->stage_count; i++) {
        const struct record_stage_time *span = &frame->stages[i];
        if (span->clock == PROTOCOL_CLOCK_CPU && span->duration_ns <= arrival_ns &&
            span->start_ns <= arrival_ns - span->duration_ns && span->start_ns + span->duration_ns > last_ns)
            last_ns = span->start_ns + span->duration_ns;
    }
    for (size_t i = 0; i < frame->stage_count; i++) {
        const struct record_stage_time *span = &frame->stages[i];
        /* A daemon's numbers are not trusted. */
        if (span->start_ns > UINT64_MAX / 4 || span->duration_ns > UINT64_MAX / 4)
            continue;
        events[count++] = (struct trace_event){
            .name = protocol_stage_text(span->stage),
            .gpu = span->clock == PROTOCOL_CLOCK_GPU,
            .rank = (uint32_t)span->stage, /* the stage frame encloses others */
            .start_ns = arrival_ns - last_ns + span->start_ns,
            .duration_ns = span->duration_ns,
            .arguments = {{"frame", frame->frame}, {"wave", span->wave}},
        };
    }
    trace_sort_events(events, count);
    for (size_t i = 0; i < count; i++)
        put(file, track_of((enum protocol_stage)events[i].rank, events[i].gpu), events[i]);
    free(events);
}

void cli_trace_frame(struct cli_trace_file *file, const struct fl_frame *frame, uint64_t now_ns)
{
    if (!file)
        return;
    const uint64_t arrival_ns = now_ns - frame->decode_ns;
    cli_trace_span(file, CLI_TRACE_CLIENT, "wait", frame->frame, now_ns - frame->wait_ns, frame->wait_ns);
    cli_trace_span(file, CLI_TRACE_CLIENT, "receive", frame->frame, arrival_ns - frame->receive_ns,
                   frame->receive_ns);
    cli_trace_span(file, CLI_TRACE_CLIENT, "decode", frame->frame, arrival_ns, frame->decode_ns);
    put_stages(file, frame, arrival_ns);
    flush(file);
}

void cli_trace_import(struct cli_trace_file *file, const struct fl_import_stats *stats, uint64_t import_start_ns,
                      uint64_t now_ns)
{
    if (!file)
        return;
    const uint64_t commit_ns = now_ns - stats->commit_ns;
    put(file, CLI_TRACE_IMPORTER,
        (struct trace_event){.name = "import",
                             .start_ns = import_start_ns,
                             .duration_ns = stats->import_ns,
                             .arguments = {{"read_bytes", stats->read_bytes},
                                           {"read_ns", stats->read_ns},
                                           {"parse_ns", stats->parse_ns},
                                           {"hash_ns", stats->hash_ns}}});
    cli_trace_span(file, CLI_TRACE_CLIENT, "load", -1, now_ns - stats->load_ns, stats->load_ns);
    put(file, CLI_TRACE_CLIENT,
        (struct trace_event){.name = "upload",
                             .start_ns = commit_ns - stats->upload_ns,
                             .duration_ns = stats->upload_ns,
                             .arguments = {{"bytes", stats->uploaded_bytes}}});
    cli_trace_span(file, CLI_TRACE_CLIENT, "commit", -1, commit_ns, stats->commit_ns);
    flush(file);
}

/* ---- life ---- */

struct cli_trace_file *cli_trace_file_create(const char *path, struct fl_error *error)
{
    struct cli_trace_file *file = calloc(1, sizeof(*file));
    /* Non-blocking: a FIFO without a reader is an error instead of an endless wait. */
    const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, 0666);
    if (!file || fd < 0 || !(file->out = fdopen(fd, "w"))) {
        fl_error_set(error, FL_ERROR_FILE, path, "the trace file cannot be written: %s", strerror(errno));
        if (fd >= 0)
            close(fd);
        free(file);
        return NULL;
    }
    file->path = path;
    file->writer = (struct trace_writer){file->out, TRACE_FILE_BEGIN, &file->threads};
    trace_write_process_name(&file->writer, 1, "farlight");
    trace_write_process_name(&file->writer, 2, "farlightd");
    return file;
}

bool cli_trace_file_destroy(struct cli_trace_file *file, struct fl_error *error)
{
    if (!file)
        return true;
    fputs(TRACE_FILE_END, file->out);
    flush(file);
    if (ferror(file->out) != 0 && file->failure == 0)
        file->failure = EIO; /* a write failed between two flushes */
    if (fclose(file->out) != 0 && file->failure == 0)
        file->failure = errno;
    const int failure = file->failure;
    if (failure != 0)
        fl_error_set(error, FL_ERROR_FILE, file->path, "the trace file cannot be written: %s", strerror(failure));
    free(file);
    return failure == 0;
}
