/* SPDX-License-Identifier: MIT */
/* The destinations of a job's frames: image files, one for all or one per frame, or a video. */
#ifndef FARLIGHT_CLI_JOBS_SINK_H
#define FARLIGHT_CLI_JOBS_SINK_H

#include "options/job.h"
#include "lib/text.h"

/* Of a frame: all of it, or one of two views side by side. */
enum cli_part { CLI_PART_ALL, CLI_PART_LEFT, CLI_PART_RIGHT };

struct cli_sink {
    const struct cli_job *job;
    struct cli_output output;
    bool is_series, to_stdout;
    enum cli_part part;
    char part_path[4096];          /* of a part, the output's path */
    struct fl_pattern pattern;     /* of a series */
    char folder[4096], path[4352]; /* the image's path; of a series, that of the current frame */
    char undigested[4352];         /* the path of an image that is being written, and gets a digest; or empty */
    const char *device;            /* to be written to when all is complete; NULL: none */
    bool has_temporary;            /* `folder` is to be removed */
    struct fl_exporter *exporter;  /* of images */
    struct fl_video *video;
    struct fl_y4m *y4m;
    int y4m_fd; /* of a file under a temporary name, `path`; 0: none */
};

/* All zero at first. */
struct cli_sinks {
    struct cli_sink *items;
    size_t count;
};

/* Finds every failure that can be found before rendering. */
bool cli_sinks_prepare(struct cli_sinks *sinks, const struct cli_job *job, bool is_series, struct fl_error *error);
/* Starts the programs that write. */
bool cli_sinks_start(struct cli_sinks *sinks, struct fl_error *error);
/* Writes the names of the scene's objects and materials, where files have them, to the frames that follow. */
bool cli_sinks_names(struct cli_sinks *sinks, struct fl_scene *scene, struct fl_error *error);
/* Whether the frame's picture already exists, complete and of the wanted size, in every sink. */
bool cli_sinks_have(struct cli_sinks *sinks, uint32_t frame);
/* The path of the picture that was passed on last, of the first sink. */
void cli_sinks_path(const struct cli_sinks *sinks, char *path, size_t path_bytes);
/* Passes the frame on; the files of the previous frame are complete when this returns true. */
bool cli_sinks_write(struct cli_sinks *sinks, const struct fl_frame *frame, struct fl_error *error);
/* Waits until all is written. */
bool cli_sinks_finish(struct cli_sinks *sinks, struct fl_error *error);
/* Ends the programs; incomplete files are removed. */
void cli_sinks_close(struct cli_sinks *sinks);

#endif
