/* SPDX-License-Identifier: MIT */
/* Writer of trace events, in a thread of its own. */
#include "base/timeline.h"

#include "base/file_io.h"
#include "base/log.h"
#include "protocol/common/trace_event.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define WAITING_MAX_BYTES (8u << 20)
#define JOBS_MAX 64u /* jobs with remembered tracks; the one unused for longest gets new ones */

static const char head[] = TRACE_FILE_BEGIN, separator[] = TRACE_FILE_SEPARATOR, tail[] = TRACE_FILE_END;

enum track { TRACK_RENDER, TRACK_OUTPUT, TRACK_GPU, TRACK_COUNT };

struct job_tracks {
    uint64_t client, last_used;
    uint32_t job;
    struct trace_track tracks[TRACK_COUNT];
};

struct timeline {
    int fd;
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    uint64_t limit_bytes;
    /* Guarded by the mutex. */
    char *waiting; /* WAITING_MAX_BYTES */
    size_t waiting_bytes;
    bool stopping, failed;
    /* Used by the reporting thread alone. */
    uint64_t accepted_bytes, left_out, threads, uses;
    bool full;
    struct job_tracks jobs[JOBS_MAX];
};

/* ---- writing ------------------------------------------------------------------------------------------ */

static void *write_waiting(void *context)
{
    struct timeline *timeline = context;
    char *mine = malloc(WAITING_MAX_BYTES);
    pthread_mutex_lock(&timeline->mutex);
    for (;;) {
        while (timeline->waiting_bytes == 0 && !timeline->stopping)
            pthread_cond_wait(&timeline->changed, &timeline->mutex);
        size_t count = timeline->waiting_bytes;
        if (count == 0 || !mine)
            break;
        char *full = timeline->waiting;
        timeline->waiting = mine;
        timeline->waiting_bytes = 0;
        mine = full;
        pthread_mutex_unlock(&timeline->mutex);
        bool ok = file_write_all(timeline->fd, mine, count);
        if (!ok)
            log_write(LOG_WARNING, "trace-file", "cannot be written: %s; nothing more is", strerror(errno));
        pthread_mutex_lock(&timeline->mutex);
        if (!ok) {
            timeline->failed = true;
            break;
        }
    }
    pthread_mutex_unlock(&timeline->mutex);
    free(mine);
    return NULL;
}

/* Accepts a block of one or more events, separated. */
static void accept(struct timeline *timeline, const char *block, size_t count)
{
    size_t separator_bytes = timeline->accepted_bytes > 0 ? sizeof(separator) - 1 : 0;
    uint64_t fixed_bytes = sizeof(head) - 1 + sizeof(tail) - 1 + separator_bytes;
    if (timeline->limit_bytes < fixed_bytes + timeline->accepted_bytes ||
        count > timeline->limit_bytes - fixed_bytes - timeline->accepted_bytes) {
        timeline->full = true;
        log_write(LOG_WARNING, "trace-file", "has reached its limit of %" PRIu64 " bytes; nothing more is written",
                  timeline->limit_bytes);
        return;
    }
    pthread_mutex_lock(&timeline->mutex);
    if (timeline->failed) {
        timeline->full = true;
    } else if (separator_bytes + count > WAITING_MAX_BYTES - timeline->waiting_bytes) {
        timeline->left_out++;
        memset(timeline->jobs, 0, sizeof(timeline->jobs)); /* the names of new tracks may be lost with it */
    } else {
        memcpy(timeline->waiting + timeline->waiting_bytes, separator, separator_bytes);
        memcpy(timeline->waiting + timeline->waiting_bytes + separator_bytes, block, count);
        timeline->waiting_bytes += separator_bytes + count;
        timeline->accepted_bytes += separator_bytes + count;
        pthread_cond_signal(&timeline->changed);
    }
    pthread_mutex_unlock(&timeline->mutex);
}

/* ---- events ------------------------------------------------------------------------------------------- */

static struct job_tracks *find_tracks(struct timeline *timeline, const struct timeline_frame *frame,
                                      struct trace_writer *writer)
{
    struct job_tracks *oldest = &timeline->jobs[0];
    timeline->uses++;
    for (size_t i = 0; i < JOBS_MAX; i++) {
        struct job_tracks *tracks = &timeline->jobs[i];
        if (tracks->last_used > 0 && tracks->client == frame->client && tracks->job == frame->job) {
            tracks->last_used = timeline->uses;
            return tracks;
        }
        if (tracks->last_used < oldest->last_used)
            oldest = tracks;
    }
    *oldest = (struct job_tracks){.client = frame->client, .job = frame->job, .last_used = timeline->uses};
    char name[160];
    snprintf(name, sizeof(name), "client %" PRIu64 " %s", frame->client, frame->client_name);
    trace_write_process_name(writer, frame->client, name);
    return oldest;
}

static enum track track_of(enum stage stage, bool gpu)
{
    if (gpu)
        return TRACK_GPU;
    return stage == STAGE_ENCODE || stage == STAGE_QUEUE || stage == STAGE_SEND ? TRACK_OUTPUT : TRACK_RENDER;
}

static void print_frame(struct timeline *timeline, const struct timeline_frame *frame, struct trace_writer *writer)
{
    static const char *const names[TRACK_COUNT] = {"render, CPU", "output, CPU", "render, GPU"};
    const struct stage_times *times = frame->times;
    struct job_tracks *job = find_tracks(timeline, frame, writer);
    struct trace_event events[STAGE_SPANS_MAX];
    for (uint32_t i = 0; i < times->count; i++) {
        const struct record_stage_time *span = &times->spans[i];
        events[i] = (struct trace_event){
            .name = stage_name(span->stage),
            .gpu = span->clock == CLOCK_GPU,
            .rank = span->stage, /* the frame encloses its only stage */
            .process = frame->client,
            .start_ns = times->origin_ns + span->start_ns,
            .duration_ns = span->duration_ns,
            .arguments = {{"job", frame->job}, {"frame", frame->frame}, {"wave", span->wave}},
        };
    }
    trace_sort_events(events, times->count);
    for (uint32_t i = 0; i < times->count; i++) {
        enum track track = track_of((enum stage)events[i].rank, events[i].gpu);
        char name[64];
        snprintf(name, sizeof(name), "job %" PRIu32 ": %s", frame->job, names[track]);
        trace_place_event(writer, &job->tracks[track], name, &events[i]);
        trace_write_event(writer, &events[i]);
    }
}

void timeline_frame(struct timeline *timeline, const struct timeline_frame *frame)
{
    char *block = NULL;
    size_t count = 0;
    if (!timeline || timeline->full || frame->times->count == 0)
        return;
    FILE *out = open_memstream(&block, &count);
    if (!out)
        return;
    struct trace_writer writer = {out, "", &timeline->threads};
    print_frame(timeline, frame, &writer);
    if (fclose(out) == 0)
        accept(timeline, block, count);
    free(block);
}

/* ---- life --------------------------------------------------------------------------------------------- */

struct timeline *timeline_create(const char *path, uint64_t limit_bytes, struct error *error)
{
    struct timeline *timeline = calloc(1, sizeof(*timeline));
    if (!timeline || !(timeline->waiting = malloc(WAITING_MAX_BYTES))) {
        free(timeline);
        error_set(error, ERROR_OUT_OF_MEMORY, path, "no memory for a trace file");
        return NULL;
    }
    timeline->limit_bytes = limit_bytes;
    pthread_mutex_init(&timeline->mutex, NULL);
    pthread_cond_init(&timeline->changed, NULL);
    /* O_NONBLOCK: a FIFO without a reader is an error and not a daemon that never starts. */
    timeline->fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, 0644);
    int failure = timeline->fd < 0 ? errno : 0;
    if (!failure && !file_write_all(timeline->fd, head, sizeof(head) - 1))
        failure = errno;
    if (!failure)
        failure = pthread_create(&timeline->thread, NULL, write_waiting, timeline);
    if (!failure)
        return timeline;
    error_set(error, ERROR_INVALID, path, "the trace file cannot be written: %s", strerror(failure));
    if (timeline->fd >= 0)
        close(timeline->fd);
    pthread_cond_destroy(&timeline->changed);
    pthread_mutex_destroy(&timeline->mutex);
    free(timeline->waiting);
    free(timeline);
    return NULL;
}

void timeline_destroy(struct timeline *timeline)
{
    if (!timeline)
        return;
    pthread_mutex_lock(&timeline->mutex);
    timeline->stopping = true;
    pthread_cond_signal(&timeline->changed);
    pthread_mutex_unlock(&timeline->mutex);
    pthread_join(timeline->thread, NULL);
    if (!timeline->failed && !file_write_all(timeline->fd, tail, sizeof(tail) - 1))
        log_write(LOG_WARNING, "trace-file", "cannot be ended: %s", strerror(errno));
    close(timeline->fd);
    if (timeline->left_out > 0)
        log_write(LOG_WARNING, "trace-file", "the disk was too slow for %" PRIu64 " frames", timeline->left_out);
    pthread_cond_destroy(&timeline->changed);
    pthread_mutex_destroy(&timeline->mutex);
    free(timeline->waiting);
    free(timeline);
}
