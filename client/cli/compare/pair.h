/* SPDX-License-Identifier: MIT */
/* The pictures of a job rendered in two ways into temporary files, and compared as images. */
#ifndef FARLIGHT_CLI_COMPARE_PAIR_H
#define FARLIGHT_CLI_COMPARE_PAIR_H

#include "options/image_path.h"
#include "options/job.h"
#include "options/loading.h"
#include "options/progress.h"
#include "comparison.h"

enum cli_pair_side { CLI_PAIR_REFERENCE, CLI_PAIR_COMPARED, CLI_PAIR_SIDES };

/* All zero at first, but for job and image. Not to be moved once it has begun. */
struct cli_pair {
    struct cli_job job;
    enum cli_image image; /* of the files: EXR has 32-bit floats of linear light, PNG what a screen shows */
    bool json;
    struct cli_limits limits;
    struct fl_compare_options images; /* what is asked of their comparison; `picture` NULL: none */
    const char *labels[CLI_PAIR_SIDES];
    struct cli_progress progress;
    struct cli_loading loading;
    struct fl_frame_run frames; /* of the job, once it has begun */
    char folder[4096];          /* of the files; empty: there is none */
    struct fl_exporter *exporter;
    struct fl_job *rendering;
    enum cli_pair_side side; /* that is rendered */
};

/* -o, --threshold, --heat-top, --time and --json: a child parser; its input is a struct cli_pair. */
extern const struct argp cli_pair_argp;
/* "agree=99.99%" or "agree=0.9999" for the share that is called `name`; all others are of the images. */
error_t cli_pair_set_limit(struct cli_pair *pair, const char *name, const char *value, double *share);

/* After the command line: cli_job_complete(), or cli_series_complete(). */
bool cli_pair_complete(struct cli_pair *pair, bool is_series);
/* Loads the scene. */
bool cli_pair_begin(struct cli_pair *pair, bool is_series, struct fl_error *error);
/* Starts to render one side, as the job's options say. */
bool cli_pair_render(struct cli_pair *pair, enum cli_pair_side side, struct fl_error *error);
/* Writes the next frame, which is the caller's; NULL with error->code FL_ERROR_NONE: there is none any more. */
struct fl_frame *cli_pair_next(struct cli_pair *pair, struct fl_error *error);
/* Compares both pictures of a frame, and removes them. `picture`: where the reference, what is compared with it
 * and the errors go, side by side; NULL: nowhere. */
bool cli_pair_compare(struct cli_pair *pair, uint32_t frame, const char *picture, struct fl_comparison *figures,
                      struct fl_error *error);
void cli_pair_finish(struct cli_pair *pair);

#endif
