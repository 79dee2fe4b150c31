/* SPDX-License-Identifier: MIT */
#include "cli/trace_file.h"

#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define LANES_MAX 16u
#define DEPTH_MAX 8u

/* Events of one thread nest, or follow each other. */
struct lane {
    uint64_t last_start_ns;
    uint64_t ends_ns[DEPTH_MAX]; /* of the events that the last one is within, and its own */
    unsigned depth;
    int thread;
};

struct cli_trace_file {
    FILE *out;
    const char *path;
    bool begun;  /* an event is in it */
    int failure; /* errno of the first write that failed; 0: none */
    int threads;
    unsigned lane_counts[CLI_TRACE_TRACK_COUNT];
    struct lane lanes[CLI_TRACE_TRACK_COUNT][LANES_MAX];
};

static const struct {
    int process;
    const char *name;
} tracks[CLI_TRACE_TRACK_COUNT] = {
    [CLI_TRACE_COMMAND] = {1, "command"},    [CLI_TRACE_CLIENT] = {1, "client"},
    [CLI_TRACE_IMPORTER] = {1, "importer"},  [CLI_TRACE_RENDER] = {2, "render, CPU"},
    [CLI_TRACE_OUTPUT] = {2, "output, CPU"}, [CLI_TRACE_GPU] = {2, "render, GPU"},
};

/* What is there can be looked at while the command runs, and survives a crash. */
static void flush(struct cli_trace_file *file)
{
    if (fflush(file->out) != 0 && file->failure == 0)
        file->failure = errno;
}

/* ---- events ---- */

static void put(struct cli_trace_file *file, json_t *event)
{
    fputs(file->begun ? ",\n" : "[\n", file->out);
    if (event)
        json_dumpf(event, file->out, JSON_COMPACT | JSON_REAL_PRECISION(15));
    file->begun = true;
    json_decref(event);
}

static void put_name(struct cli_trace_file *file, const char *kind, int process, int thread, const char *name)
{
    put(file, json_pack("{s:s,s:s,s:i,s:i,s:{s:s}}", "name", kind, "ph", "M", "pid", process, "tid", thread,
                        "args", "name", name));
}

/* Whether the lane goes on with such an event; then it has it. */
static bool lane_takes(struct lane *lane, uint64_t start_ns, uint64_t end_ns)
{
    unsigned depth = lane->depth;
    if (start_ns < lane->last_start_ns)
        return false;
    while (depth > 0 && lane->ends_ns[depth - 1] <= start_ns)
        depth--;
    if (depth == DEPTH_MAX || (depth > 0 && end_ns > lane->ends_ns[depth - 1]))
        return false;
    lane->ends_ns[depth] = end_ns;
    lane->depth = depth + 1;
    lane->last_start_ns = start_ns;
    return true;
}

static int thread_of(struct cli_trace_file *file, enum cli_trace_track track, uint64_t start_ns, uint64_t end_ns)
{
    unsigned *count = &file->lane_counts[track];
    for (unsigned i = 0; i < *count; i++)
        if (lane_takes(&file->lanes[track][i], start_ns, end_ns))
            return file->lanes[track][i].thread;
    if (*count == LANES_MAX) /* better drawn over others than not at all */
        return file->lanes[track][LANES_MAX - 1].thread;
    struct lane *lane = &file->lanes[track][(*count)++];
    char name[48], number[16] = "";
    lane->thread = ++file->threads;
    lane_takes(lane, start_ns, end_ns);
    if (*count > 1)
        snprintf(number, sizeof(number), " (%u)", *count);
    snprintf(name, sizeof(name), "%s%s", tracks[track].name, number);
    put_name(file, "thread_name", tracks[track].process, lane->thread, name);
    return lane->thread;
}

/* Takes `args` over. */
static void put_span(struct cli_trace_file *file, enum cli_trace_track track, const char *name, json_t *args,
                     uint64_t start_ns, uint64_t duration_ns)
{
    const int thread = thread_of(file, track, start_ns, start_ns + duration_ns);
    put(file, json_pack("{s:s,s:s,s:s,s:f,s:f,s:i,s:i,s:o}", "name", name, "cat",
                        track == CLI_TRACE_GPU ? "gpu" : "cpu", "ph", "X", "ts", (double)start_ns * 1e-3, "dur",
                        (double)duration_ns * 1e-3, "pid", tracks[track].process, "tid", thread, "args", args));
}

void cli_trace_span(struct cli_trace_file *file, enum cli_trace_track track, const char *name, int64_t frame,
                    uint64_t start_ns, uint64_t duration_ns)
{
    if (file)
        put_span(file, track, name, frame < 0 ? json_object() : json_pack("{s:I}", "frame", (json_int_t)frame),
                 start_ns, duration_ns);
}

/* ---- frames ---- */

static enum cli_trace_track track_of(const struct record_stage_time *span)
{
    if (span->clock == PROTOCOL_CLOCK_GPU)
        return CLI_TRACE_GPU;
    return span->stage == PROTOCOL_STAGE_ENCODE || span->stage == PROTOCOL_STAGE_QUEUE ||
                   span->stage == PROTOCOL_STAGE_SEND
               ? CLI_TRACE_OUTPUT
               : CLI_TRACE_RENDER;
}

/* By start; what contains others before them. */
static int compare_spans(const void *a, const void *b)
{
    const struct record_stage_time *first = *(const struct record_stage_time *const *)a;
    const struct record_stage_time *second = *(const struct record_stage_time *const *)b;
    if (first->start_ns != second->start_ns)
        return first->start_ns < second->start_ns ? -1 : 1;
    if (first->duration_ns != second->duration_ns)
        return first->duration_ns > second->duration_ns ? -1 : 1;
    return (first->stage < second->stage) - (first->stage > second->stage); /* frame contains its one stage */
}

static void put_stages(struct cli_trace_file *file, const struct fl_frame *frame, uint64_t arrival_ns)
{
    const struct record_stage_time **spans = calloc(frame->stage_count + 1, sizeof(*spans));
    uint64_t last_ns = 0;
    if (!spans)
        return;
    for (size_t i = 0; i < frame->stage_count; i++) {
        const struct record_stage_time *span = &frame->stages[i];
        spans[i] = span;
        if (span->clock == PROTOCOL_CLOCK_CPU && span->duration_ns <= arrival_ns &&
            span->start_ns <= arrival_ns - span->duration_ns && span->start_ns + span->duration_ns > last_ns)
            last_ns = span->start_ns + span->duration_ns;
    }
    qsort(spans, frame->stage_count, sizeof(*spans), compare_spans);
    for (size_t i = 0; i < frame->stage_count; i++) {
        const struct record_stage_time *span = spans[i];
        /* A daemon may say what it likes. */
        if (span->start_ns > UINT64_MAX / 4 || span->duration_ns > UINT64_MAX / 4)
            continue;
        put_span(file, track_of(span), protocol_stage_text(span->stage),
                 json_pack("{s:I,s:I}", "frame", (json_int_t)frame->frame, "wave", (json_int_t)span->wave),
                 arrival_ns - last_ns + span->start_ns, span->duration_ns);
    }
    free(spans);
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
    put_span(file, CLI_TRACE_IMPORTER, "import",
             json_pack("{s:I,s:I,s:I,s:I}", "read_bytes", (json_int_t)stats->read_bytes, "read_ns",
                       (json_int_t)stats->read_ns, "parse_ns", (json_int_t)stats->parse_ns, "hash_ns",
                       (json_int_t)stats->hash_ns),
             import_start_ns, stats->import_ns);
    cli_trace_span(file, CLI_TRACE_CLIENT, "load", -1, now_ns - stats->load_ns, stats->load_ns);
    put_span(file, CLI_TRACE_CLIENT, "upload", json_pack("{s:I}", "bytes", (json_int_t)stats->uploaded_bytes),
             commit_ns - stats->upload_ns, stats->upload_ns);
    cli_trace_span(file, CLI_TRACE_CLIENT, "commit", -1, commit_ns, stats->commit_ns);
    flush(file);
}

/* ---- life ---- */

struct cli_trace_file *cli_trace_file_create(const char *path, struct fl_error *error)
{
    struct cli_trace_file *file = calloc(1, sizeof(*file));
    /* Not blocking: a FIFO without a reader is an error and no endless wait. */
    const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, 0666);
    if (!file || fd < 0 || !(file->out = fdopen(fd, "w"))) {
        fl_error_set(error, FL_ERROR_FILE, path, "the trace file cannot be written: %s", strerror(errno));
        if (fd >= 0)
            close(fd);
        free(file);
        return NULL;
    }
    file->path = path;
    put_name(file, "process_name", 1, 0, "farlight");
    put_name(file, "process_name", 2, 0, "farlightd");
    return file;
}

bool cli_trace_file_destroy(struct cli_trace_file *file, struct fl_error *error)
{
    if (!file)
        return true;
    fputs("\n]\n", file->out);
    flush(file);
    if (ferror(file->out) != 0 && file->failure == 0)
        file->failure = EIO; /* a write between two flushes */
    if (fclose(file->out) != 0 && file->failure == 0)
        file->failure = errno;
    const int failure = file->failure;
    if (failure != 0)
        fl_error_set(error, FL_ERROR_FILE, file->path, "the trace file cannot be written: %s", strerror(failure));
    free(file);
    return failure == 0;
}
