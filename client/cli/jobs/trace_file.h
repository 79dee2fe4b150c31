/* SPDX-License-Identifier: MIT */
/* The stages of a command as a file of trace events (protocol/common/trace_event.h) by the monotonic clock. Two
 * processes, the client and the daemon, and their tracks. After a crash the file lacks its last line, "]", which
 * the format allows. */
#ifndef FARLIGHT_CLI_JOBS_TRACE_FILE_H
#define FARLIGHT_CLI_JOBS_TRACE_FILE_H

#include "lib/farlight.h"

struct cli_trace_file;

enum cli_trace_track {
    CLI_TRACE_COMMAND,  /* all of it */
    CLI_TRACE_CLIENT,   /* what the client does or waits for */
    CLI_TRACE_IMPORTER, /* beside the client */
    CLI_TRACE_RENDER,   /* of the daemon: CPU, until a frame is read back */
    CLI_TRACE_OUTPUT,   /* encoding, waiting, sending */
    CLI_TRACE_GPU,
    CLI_TRACE_TRACK_COUNT
};

/* Replaces the file. */
struct cli_trace_file *cli_trace_file_create(const char *path, struct fl_error *error);
/* Writes the end of the array. False: not all of it could be written. Takes NULL. */
bool cli_trace_file_destroy(struct cli_trace_file *file, struct fl_error *error);

/* `file` may be NULL. `frame` < 0: of no frame. */
void cli_trace_span(struct cli_trace_file *file, enum cli_trace_track track, const char *name, int64_t frame,
                    uint64_t start_ns, uint64_t duration_ns);
/* The client's wait for a frame that has just arrived, and the daemon's stages. The daemon's clock differs: its
 * stages are placed so that the last of them ends at the frame's arrival. */
void cli_trace_frame(struct cli_trace_file *file, const struct fl_frame *frame, uint64_t now_ns);
/* The costs of an import that has just ended. */
void cli_trace_import(struct cli_trace_file *file, const struct fl_import_stats *stats, uint64_t import_start_ns,
                      uint64_t now_ns);

#endif
