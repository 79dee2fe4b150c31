/* SPDX-License-Identifier: MIT */
/* A command that renders: what it has done so far, and its two halves. session.c loads the scene, waits for lost
 * daemons and for changed files; session_frames.c fetches frames and writes them. */
#ifndef FARLIGHT_CLI_JOBS_SESSION_H
#define FARLIGHT_CLI_JOBS_SESSION_H

#include "picture_part.h"
#include "sink.h"
#include "trace_file.h"
#include "options/watch.h"
#include "structure.h"
#include "options/loading.h"
#include "options/progress.h"

/* Renders the job's frames into its outputs: paths or "-", patterns if `is_series`. */
int cli_run_job(struct cli_job *job, bool is_series);
/* Checks what can be checked of an animation without a daemon. */
int cli_dry_run(struct cli_job *job);

struct cli_session {
    struct cli_job *job;
    bool is_series;
    struct cli_sinks sinks;
    bool sinks_started, sink_failed;
    struct cli_loading loading;
    struct cli_watch watch;
    struct message_render typed; /* the job's options before a scene has settled them */
    struct fl_job *rendering;
    struct cli_picture_part part;
    bool was_reached, was_loaded; /* the daemon, once at least; likewise, and it has accepted the scene */
    bool has_set;                 /* which frames are wanted is known */
    struct fl_frame_set set;
    size_t run;        /* the current one of the set */
    bool begun;        /* of this run a frame has been written */
    uint64_t next;     /* once begun: its first frame that has not */
    float noise;       /* of the last frame that has come */
    uint32_t done;     /* frames written */
    unsigned failures; /* lost connections since the last frame */
    uint64_t lost_ns;  /* when the first of them was lost */
    struct cli_warned warned;
    struct cli_timings *timings;
    struct cli_trace_file *trace; /* NULL: none is wanted */
    struct cli_progress progress;
    bool is_being_written; /* a picture of a series: */
    uint32_t written_frame;
    uint64_t frame_ns;      /* when the picture before it had come */
    double written_seconds; /* from then until it had */
    char written_path[4352];
    uint32_t written_samples; /* of a pixel */
    uint64_t begin_ns, export_ns;
};

/* Renders the frames of the set that have not been written, and passes them to the sinks. */
bool session_render(struct cli_session *session, struct fl_error *error);
/* Waits until the last file is complete. */
bool session_finish_sinks(struct cli_session *session, struct fl_error *error);
void session_show_progress(struct cli_session *session); /* of a series */

#endif
