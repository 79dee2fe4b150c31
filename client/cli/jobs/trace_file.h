/* SPDX-License-Identifier: MIT */
/* The stages of a command as a file of trace events (protocol/common/trace_event.h) by the monotonic clock, for
 * two processes, the client and the daemon, and their tracks. After a crash the file lacks its last line, "]",
 * which the format allows. */
#ifndef FARLIGHT_CLI_JOBS_TRACE_FILE_H
#define FARLIGHT_CLI_JOBS_TRACE_FILE_H

#include "lib/farlight.h"

struct cli_trace_file;

enum cli_trace_track {
    CLI_TRACE_COMMAND,  /* the whole command */
    CLI_TRACE_CLIENT,   /* work and waits of the client */
    CLI_TRACE_IMPORTER, /* parallel to the client */
    CLI_TRACE_RENDER,   /* the daemon's CPU, until a frame is read back */
    CLI_TRACE_OUTPUT,   /* encoding, waiting, sending */
    CLI_TRACE_GPU,
    CLI_TRACE_TRACK_COUNT
};

/* Creates the file, or replaces an existing one. */
struct cli_trace_file *cli_trace_file_create(const char *path, struct fl_error *error);
/* Writes the end of the array. False: an error has truncated the file. Accepts NULL. */
bool cli_trace_file_destroy(struct cli_trace_file *file, struct fl_error *error);

/* Adds a span; `file` may be NULL. `frame` < 0: no frame. */
void cli_trace_span(struct cli_trace_file *file, enum cli_trace_track track, const char *name, int64_t frame,
                    uint64_t start_ns, uint64_t duration_ns);
/* Adds the client's wait for a frame that has just arrived, and the daemon's stages. The daemon's clock
 * differs, so its stages are placed so that the last one ends at the frame's arrival. */
void cli_trace_frame(struct cli_trace_file *file, const struct fl_frame *frame, uint64_t now_ns);
/* Adds the costs of an import that has just ended. */
void cli_trace_import(struct cli_trace_file *file, const struct fl_import_stats *stats, uint64_t import_start_ns,
                      uint64_t now_ns);

#endif
