/* SPDX-License-Identifier: MIT */
/* Stage times of all frames as a file of trace events (protocol/common/trace_event.h) by clock_now_ns(). Processes
 * are clients, tracks those of a job: render, output (encoding, waiting, sending) and GPU.
 * A thread of its own writes; callers never wait for the disk. While the daemon runs, and after a crash,
 * the file lacks its last line, "]", which the format allows. */
#ifndef FARLIGHT_BASE_TIMELINE_H
#define FARLIGHT_BASE_TIMELINE_H

#include "base/error.h"
#include "base/stage_times.h"

struct timeline;

struct timeline_frame {
    uint64_t client;
    const char *client_name; /* UTF-8 */
    uint32_t job, frame;
    const struct stage_times *times;
};

/* Creates a timeline; replaces the file at `path`. When it would exceed `limit_bytes`, nothing more is written,
 * with a single line in the log. */
struct timeline *timeline_create(const char *path, uint64_t limit_bytes, struct error *error);
/* Adds a frame; copies its data. From one thread. `timeline` may be NULL. A frame is left out, and counted, if
 * the disk is so slow that 8 MiB wait for it. */
void timeline_frame(struct timeline *timeline, const struct timeline_frame *frame);
/* Writes the waiting events and the end of the array. */
void timeline_destroy(struct timeline *timeline);

#endif
