/* SPDX-License-Identifier: MIT */
/* Progress on standard error. */
#ifndef FARLIGHT_OPTIONS_PROGRESS_H
#define FARLIGHT_OPTIONS_PROGRESS_H

#include "lib/farlight.h"

enum cli_progress_form {
    CLI_PROGRESS_LINES,
    CLI_PROGRESS_BAR,   /* drawn over and over on one line */
    CLI_PROGRESS_OPENJD /* what Open Job Description reads on standard output */
};

enum cli_timings_form { CLI_TIMINGS_NONE, CLI_TIMINGS_TABLE, CLI_TIMINGS_JSON };

/* What a command says while it works and of its work, as typed. */
struct cli_talk {
    bool quiet;
    bool has_progress; /* else by whether there is a terminal */
    enum cli_progress_form progress;
    enum cli_timings_form timings;
    const char *trace_file; /* NULL: none */
};

struct cli_progress {
    enum cli_progress_form form;
    bool silent;
    bool drawn;
    uint64_t begin_ns, shown_ns, first_ns;
    uint32_t total;
    float error;             /* as it was last told, that many seconds after the beginning */
    double error_s, slope;   /* it falls as that power of the time */
    uint64_t resident_bytes; /* the most that a line has told */
};

void cli_progress_begin(struct cli_progress *progress, const struct cli_talk *talk);
void cli_progress_import(struct cli_progress *progress, uint64_t done_bytes, uint64_t total_bytes,
                         const char *what);
/* From the first call on frames are counted. */
void cli_progress_frames(struct cli_progress *progress, uint32_t done, uint32_t total);
/* `done` of `total` steps of different length are finished; `what` is the current one. Without a terminal one line
 * per step, once it has taken a second. */
void cli_progress_step(struct cli_progress *progress, uint32_t done, uint32_t total, const char *what);
/* A progressive picture has `held` samples per pixel; `total` 0: only an interruption ends it. */
void cli_progress_samples(struct cli_progress *progress, uint32_t held, uint32_t total);
/* A picture has that error where it is largest, and goes on until it is `wanted`, or all have `total` samples. */
struct cli_noise {
    float error, wanted;
    uint32_t held, total;
};
void cli_progress_noise(struct cli_progress *progress, const struct cli_noise *noise);
/* A line in the log for a picture that is complete: its number, seconds, the most memory that the command and
 * what it has started had at any line, and its file. Nothing where a bar is drawn. */
void cli_progress_frame(struct cli_progress *progress, uint32_t frame, double seconds, const char *path);
/* Removes the bar, so that other output can be written. */
void cli_progress_clear(struct cli_progress *progress);
/* The bar of a finished command stays; any other is removed. */
void cli_progress_end(struct cli_progress *progress, bool done);

#endif
