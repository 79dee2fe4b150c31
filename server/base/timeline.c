/* SPDX-License-Identifier: MIT */
#include "base/timeline.h"

#include "base/log.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define WAITING_MAX_BYTES (8u << 20)
#define JOBS_MAX 64u  /* whose tracks are remembered; the one unused for longest gets new ones */
#define LANES_MAX 16u /* as many frames of a job may be in flight */
#define DEPTH_MAX 8u

static const char head[] = "[\n", separator[] = ",\n", tail[] = "\n]\n";

enum track { TRACK_RENDER, TRACK_OUTPUT, TRACK_GPU, TRACK_COUNT };

/* Events of one thread nest, or follow each other. */
struct lane {
    uint64_t thread, last_start_ns;
    uint64_t ends_ns[DEPTH_MAX]; /* of the events that the last one is within, and its own */
    unsigned depth;
};

struct job_tracks {
    uint64_t client, last_used;
    uint32_t job;
    unsigned lane_counts[TRACK_COUNT];
    struct lane lanes[TRACK_COUNT][LANES_MAX];
};

struct timeline {
    int fd;
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    uint64_t limit_bytes;
    /* Under the mutex. */
    char *waiting; /* WAITING_MAX_BYTES */
    size_t waiting_bytes;
    bool stopping, failed;
    /* Of the thread that reports. */
    uint64_t accepted_bytes, left_out, threads, uses;
    bool full;
    struct job_tracks jobs[JOBS_MAX];
};

/* ---- writing ------------------------------------------------------------------------------------------ */

static bool write_all(int fd, const char *bytes, size_t count)
{
    while (count > 0) {
        ssize_t written = write(fd, bytes, count);
        if (written < 0 && errno != EINTR)
            return false;
        if (written > 0) {
            bytes += written;
            count -= (size_t)written;
        }
    }
    return true;
}

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
        bool ok = write_all(timeline->fd, mine, count);
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

/* A block is one or more events, separated. */
static void accept(struct timeline *timeline, const char *block, size_t count)
{
    size_t separator_bytes = timeline->accepted_bytes > 0 ? sizeof separator - 1 : 0;
    uint64_t fixed_bytes = sizeof head - 1 + sizeof tail - 1 + separator_bytes;
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
        memset(timeline->jobs, 0, sizeof timeline->jobs); /* the names of new tracks may be lost with it */
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

static void print_text(FILE *out, const char *text)
{
    fputc('"', out);
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        if (c == '"' || c == '\\')
            fprintf(out, "\\%c", c);
        else if (c < 0x20 || c == 0x7f)
            fprintf(out, "\\u%04x", c);
        else
            fputc(c, out);
    }
    fputc('"', out);
}

static void print_name(FILE *out, const char *kind, uint64_t process, uint64_t thread, const char *name)
{
    fprintf(out, "{\"name\":\"%s\",\"ph\":\"M\",\"pid\":%" PRIu64 ",\"tid\":%" PRIu64 ",\"args\":{\"name\":", kind,
            process, thread);
    print_text(out, name);
    fputs("}}", out);
    fputs(separator, out);
}

static struct job_tracks *find_tracks(struct timeline *timeline, const struct timeline_frame *frame, FILE *out)
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
    snprintf(name, sizeof name, "client %" PRIu64 " %s", frame->client, frame->client_name);
    print_name(out, "process_name", frame->client, 0, name);
    return oldest;
}

/* Appends the event if the lane can hold it; false otherwise. */
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

static uint64_t thread_of(struct timeline *timeline, struct job_tracks *tracks, enum track track,
                          uint64_t start_ns, uint64_t end_ns, FILE *out)
{
    static const char *const names[TRACK_COUNT] = {"render, CPU", "output, CPU", "render, GPU"};
    unsigned *count = &tracks->lane_counts[track];
    for (unsigned i = 0; i < *count; i++)
        if (lane_takes(&tracks->lanes[track][i], start_ns, end_ns))
            return tracks->lanes[track][i].thread;
    if (*count == LANES_MAX) /* more frames than may be: better drawn over others than not at all */
        return tracks->lanes[track][LANES_MAX - 1].thread;
    struct lane *lane = &tracks->lanes[track][(*count)++];
    lane->thread = ++timeline->threads;
    lane_takes(lane, start_ns, end_ns);
    char name[64], number[16] = "";
    if (*count > 1)
        snprintf(number, sizeof number, " (%u)", *count);
    snprintf(name, sizeof name, "job %" PRIu32 ": %s%s", tracks->job, names[track], number);
    print_name(out, "thread_name", tracks->client, lane->thread, name);
    return lane->thread;
}

static enum track track_of(const struct stage_span *span)
{
    if (span->clock == STAGE_GPU)
        return TRACK_GPU;
    return span->stage == STAGE_ENCODE || span->stage == STAGE_QUEUE || span->stage == STAGE_SEND ? TRACK_OUTPUT
                                                                                                  : TRACK_RENDER;
}

/* By start; an event before those that it contains. */
static int compare_spans(const void *a, const void *b)
{
    const struct stage_span *first = *(const struct stage_span *const *)a;
    const struct stage_span *second = *(const struct stage_span *const *)b;
    if (first->start_ns != second->start_ns)
        return first->start_ns < second->start_ns ? -1 : 1;
    if (first->duration_ns != second->duration_ns)
        return first->duration_ns > second->duration_ns ? -1 : 1;
    return (first->stage < second->stage) - (first->stage > second->stage); /* frame contains its one stage */
}

static void print_frame(struct timeline *timeline, const struct timeline_frame *frame, FILE *out)
{
    const struct stage_times *times = frame->times;
    const struct stage_span *spans[STAGE_SPANS_MAX];
    struct job_tracks *tracks = find_tracks(timeline, frame, out);
    for (uint32_t i = 0; i < times->count; i++)
        spans[i] = &times->spans[i];
    qsort(spans, times->count, sizeof spans[0], compare_spans);
    for (uint32_t i = 0; i < times->count; i++) {
        const struct stage_span *span = spans[i];
        uint64_t start_ns = times->origin_ns + span->start_ns;
        uint64_t thread = thread_of(timeline, tracks, track_of(span), start_ns, start_ns + span->duration_ns, out);
        fprintf(out,
                "{\"name\":\"%s\",\"cat\":\"%s\",\"ph\":\"X\",\"ts\":%" PRIu64 ".%03u,\"dur\":%" PRIu64
                ".%03u,\"pid\":%" PRIu64 ",\"tid\":%" PRIu64 ",\"args\":{\"job\":%" PRIu32 ",\"frame\":%" PRIu32
                ",\"wave\":%" PRIu32 "}}%s",
                stage_name(span->stage), span->clock == STAGE_GPU ? "gpu" : "cpu", start_ns / 1000,
                (unsigned)(start_ns % 1000), span->duration_ns / 1000, (unsigned)(span->duration_ns % 1000),
                frame->client, thread, frame->job, frame->frame, span->wave,
                i + 1 < times->count ? separator : "");
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
    print_frame(timeline, frame, out);
    if (fclose(out) == 0)
        accept(timeline, block, count);
    free(block);
}

/* ---- life --------------------------------------------------------------------------------------------- */

struct timeline *timeline_create(const char *path, uint64_t limit_bytes, struct error *error)
{
    struct timeline *timeline = calloc(1, sizeof *timeline);
    if (!timeline || !(timeline->waiting = malloc(WAITING_MAX_BYTES))) {
        free(timeline);
        error_set(error, ERROR_OUT_OF_MEMORY, path, "no memory for a trace file");
        return NULL;
    }
    timeline->limit_bytes = limit_bytes;
    pthread_mutex_init(&timeline->mutex, NULL);
    pthread_cond_init(&timeline->changed, NULL);
    /* Not blocking: a FIFO without a reader is an error and not a daemon that never starts. */
    timeline->fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, 0644);
    int failure = timeline->fd < 0 ? errno : 0;
    if (!failure && !write_all(timeline->fd, head, sizeof head - 1))
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
    if (!timeline->failed && !write_all(timeline->fd, tail, sizeof tail - 1))
        log_write(LOG_WARNING, "trace-file", "cannot be ended: %s", strerror(errno));
    close(timeline->fd);
    if (timeline->left_out > 0)
        log_write(LOG_WARNING, "trace-file", "the disk was too slow for %" PRIu64 " frames", timeline->left_out);
    pthread_cond_destroy(&timeline->changed);
    pthread_mutex_destroy(&timeline->mutex);
    free(timeline->waiting);
    free(timeline);
}
