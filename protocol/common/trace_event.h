/* SPDX-License-Identifier: MIT */
/* Trace events, which ui.perfetto.dev and chrome://tracing open: the array form of the Trace Event Format (Google.
 * Trace Event Format. 2016), complete events ("X") and names ("M"), microseconds. Events of one thread must nest
 * or follow each other, so a track has as many threads ("lanes") as it has events that overlap otherwise. */
#ifndef FARLIGHT_PROTOCOL_COMMON_TRACE_EVENT_H
#define FARLIGHT_PROTOCOL_COMMON_TRACE_EVENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#define TRACE_LANES_MAX 16u /* further overlapping events are drawn over those of the last lane */
#define TRACE_DEPTH_MAX 8u
#define TRACE_ARGUMENTS_MAX 4u

#define TRACE_FILE_BEGIN "[\n"
#define TRACE_FILE_SEPARATOR ",\n"
#define TRACE_FILE_END "\n]\n"

struct trace_argument {
    const char *name; /* NULL: this and all later arguments are unused */
    uint64_t value;
};

struct trace_event {
    const char *name;
    bool gpu;
    uint32_t rank; /* orders events of the same times; the larger one contains the other */
    uint64_t process, thread, start_ns, duration_ns;
    struct trace_argument arguments[TRACE_ARGUMENTS_MAX];
};

/* Writes events into a file, or into a part of one; errors stay with the stream. */
struct trace_writer {
    FILE *out;
    const char *before; /* text before the next event: TRACE_FILE_BEGIN in an empty file, later a separator */
    uint64_t *threads;  /* number of threads named in the file so far */
};

struct trace_lane {
    uint64_t thread, last_start_ns;
    uint64_t ends_ns[TRACE_DEPTH_MAX]; /* end times of the last event and of the events that enclose it */
    unsigned depth;
};

/* The lanes of one track; initially zero. */
struct trace_track {
    unsigned lane_count;
    struct trace_lane lanes[TRACE_LANES_MAX];
};

void trace_write_process_name(struct trace_writer *writer, uint64_t process, const char *name);
void trace_write_event(struct trace_writer *writer, const struct trace_event *event);
/* Assigns the event to a lane that can hold it, and so to a thread. A new lane's thread is called `name`, with
 * its number from the second on. */
void trace_place_event(struct trace_writer *writer, struct trace_track *track, const char *name,
                       struct trace_event *event);
/* Sorts by start; an event that encloses others comes before them. */
void trace_sort_events(struct trace_event *events, size_t count);

#endif
