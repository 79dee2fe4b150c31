/* SPDX-License-Identifier: MIT */
/* The state of a command that renders, and its two halves: session.c loads the scene, retries after losses and
 * watches files; session_frames.c fetches frames and writes them. */
#ifndef FARLIGHT_CLI_JOBS_SESSION_H
#define FARLIGHT_CLI_JOBS_SESSION_H

#include "picture_part.h"
#include "sink.h"
#include "trace_file.h"
#include "options/watch.h"
#include "structure.h"
#include "options/loading.h"
#include "options/progress.h"

/* Renders the job's frames into its outputs: paths or "-", patterns if `is_series`. Returns the exit status. */
int cli_run_job(struct cli_job *job, bool is_series);
/* Checks everything about an animation that needs no daemon. Returns the exit status. */
int cli_dry_run(struct cli_job *job);

struct cli_session {
    struct cli_job *job;
    bool is_series;
    struct cli_sinks sinks;
    bool sinks_started, sink_failed;
    struct cli_loading loading;
    struct cli_watch watch;
    struct message_render typed; /* the job's options before the scene settles them */
    struct fl_job *rendering;
    struct cli_picture_part part;
    bool was_reached, was_loaded; /* true once a daemon was reached; once it has accepted the scene */
    bool has_set;                 /* `set` is known */
    struct fl_frame_set set;
    size_t run;        /* index of the current run of the set */
    bool begun;        /* a frame of this run has been written */
    uint64_t next;     /* once begun: the run's first unwritten frame */
    float noise;       /* noise of the last frame */
    uint32_t done;     /* number of written frames */
    unsigned failures; /* lost connections since the last frame */
    uint64_t lost_ns;  /* time of the first of these losses */
    struct cli_warned warned;
    struct cli_timings *timings;
    struct cli_trace_file *trace; /* NULL: not requested */
    struct cli_progress progress;
    bool is_being_written; /* a picture of a series is being written: */
    uint32_t written_frame;
    uint64_t frame_ns;      /* time at which the previous picture arrived */
    double written_seconds; /* time from then until this one arrived */
    char written_path[4352];
    uint32_t written_samples; /* samples of a pixel */
    uint64_t begin_ns, export_ns;
};

/* Renders the unwritten frames of the set, and passes them to the sinks. */
bool session_render(struct cli_session *session, struct fl_error *error);
/* Waits until the last file is complete. */
bool session_finish_sinks(struct cli_session *session, struct fl_error *error);
void session_show_progress(struct cli_session *session); /* for a series */

#endif
