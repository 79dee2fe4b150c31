/* SPDX-License-Identifier: MIT */
/* The destinations of a job's frames: image files, one for all or one for each frame, or a video. */
#ifndef FARLIGHT_CLI_JOBS_SINK_H
#define FARLIGHT_CLI_JOBS_SINK_H

#include "options/job.h"
#include "lib/text.h"

/* The part of a frame that a sink writes: the whole frame, or one of two views side by side. */
enum cli_part { CLI_PART_ALL, CLI_PART_LEFT, CLI_PART_RIGHT };

struct cli_sink {
    const struct cli_job *job;
    struct cli_output output;
    bool is_series, to_stdout;
    enum cli_part part;
    char part_path[4096];          /* path of the output for a part */
    struct fl_pattern pattern;     /* paths of a series */
    char folder[4096], path[4352]; /* path of the image; for a series, the current frame's */
    char undigested[4352];         /* path of the image that is being written and will get a digest; or empty */
    const char *device;            /* destination of the complete file; NULL: none */
    bool has_temporary;            /* `folder` must be removed */
    struct fl_exporter *exporter;  /* images only */
    struct fl_video *video;
    struct fl_y4m *y4m;
    int y4m_fd; /* file under a temporary name, `path`; 0: none */
};

/* The sinks of a job; initially zero. */
struct cli_sinks {
    struct cli_sink *items;
    size_t count;
};

/* Reports every failure that can be found before rendering. */
bool cli_sinks_prepare(struct cli_sinks *sinks, const struct cli_job *job, bool is_series, struct fl_error *error);
/* Starts the programs that write. */
bool cli_sinks_start(struct cli_sinks *sinks, struct fl_error *error);
/* Sets the names of the scene's objects and materials, for files that hold them, in later frames. */
bool cli_sinks_names(struct cli_sinks *sinks, struct fl_scene *scene, struct fl_error *error);
/* True if the frame's picture already exists, complete and with the right size, in every sink. */
bool cli_sinks_have(struct cli_sinks *sinks, uint32_t frame);
/* The path of the last picture, in the first sink. */
void cli_sinks_path(const struct cli_sinks *sinks, char *path, size_t path_bytes);
/* Passes the frame on; the files of the previous frame are complete when this returns true. */
bool cli_sinks_write(struct cli_sinks *sinks, const struct fl_frame *frame, struct fl_error *error);
/* Waits until everything is written. */
bool cli_sinks_finish(struct cli_sinks *sinks, struct fl_error *error);
/* Ends the programs; incomplete files are removed. */
void cli_sinks_close(struct cli_sinks *sinks);

#endif
