/* SPDX-License-Identifier: MIT */
/* Pictures of a job rendered in two ways into temporary files, and compared as images. */
#ifndef FARLIGHT_CLI_COMPARE_PAIR_H
#define FARLIGHT_CLI_COMPARE_PAIR_H

#include "options/image_path.h"
#include "options/job.h"
#include "options/loading.h"
#include "options/progress.h"
#include "comparison.h"

enum cli_pair_side { CLI_PAIR_REFERENCE, CLI_PAIR_COMPARED, CLI_PAIR_SIDES };

/* A pair; initially zero except job and image. Must not be moved after cli_pair_begin. */
struct cli_pair {
    struct cli_job job;
    enum cli_image image; /* format of the files: EXR has 32-bit floats of linear light, PNG displayed colours */
    bool json;
    struct cli_limits limits;
    struct fl_compare_options images; /* options of the comparison; `picture` NULL: none */
    const char *labels[CLI_PAIR_SIDES];
    struct cli_progress progress;
    struct cli_loading loading;
    struct fl_frame_run frames; /* the job's frames, set by cli_pair_begin */
    char folder[4096];          /* folder of the files; empty: none */
    struct fl_exporter *exporter;
    struct fl_job *rendering;
    enum cli_pair_side side; /* side that is being rendered */
};

/* Parser of -o, --threshold, --heat-top, --time and --json, for use as a child parser; its input is a struct
 * cli_pair. */
extern const struct argp cli_pair_argp;
/* Reads "agree=99.99%" or "agree=0.9999" for the share called `name`; all other limits belong to the images. */
error_t cli_pair_set_limit(struct cli_pair *pair, const char *name, const char *value, double *share);

/* Completes the job after the command line, with cli_job_complete() or cli_series_complete(). */
bool cli_pair_complete(struct cli_pair *pair, bool is_series);
/* Loads the scene. */
bool cli_pair_begin(struct cli_pair *pair, bool is_series, struct fl_error *error);
/* Starts to render one side with the job's options. */
bool cli_pair_render(struct cli_pair *pair, enum cli_pair_side side, struct fl_error *error);
/* Writes the next frame, which the caller then owns; NULL with error->code FL_ERROR_NONE: there are no more. */
struct fl_frame *cli_pair_next(struct cli_pair *pair, struct fl_error *error);
/* Compares both pictures of a frame, and removes them. `picture`: file for the reference, the compared picture
 * and the errors, side by side; NULL: none. */
bool cli_pair_compare(struct cli_pair *pair, uint32_t frame, const char *picture, struct fl_comparison *figures,
                      struct fl_error *error);
void cli_pair_finish(struct cli_pair *pair);

#endif
