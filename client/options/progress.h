/* SPDX-License-Identifier: MIT */
/* Progress on standard error. */
#ifndef FARLIGHT_OPTIONS_PROGRESS_H
#define FARLIGHT_OPTIONS_PROGRESS_H

#include "lib/farlight.h"

enum cli_progress_form {
    CLI_PROGRESS_LINES,
    CLI_PROGRESS_BAR,   /* redrawn on one line */
    CLI_PROGRESS_OPENJD /* for Open Job Description, on standard output */
};

enum cli_timings_form { CLI_TIMINGS_NONE, CLI_TIMINGS_TABLE, CLI_TIMINGS_JSON };

/* Output of a command about its work, as typed. */
struct cli_talk {
    bool quiet;
    bool has_progress; /* set by an option; else a terminal decides */
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
    float error;             /* last reported error, and its time in seconds after the start */
    double error_s, slope;   /* exponent of its decrease over time */
    uint64_t resident_bytes; /* maximum so far */
};

void cli_progress_begin(struct cli_progress *progress, const struct cli_talk *talk);
void cli_progress_import(struct cli_progress *progress, uint64_t done_bytes, uint64_t total_bytes,
                         const char *what);
/* Counts frames from the first call on. */
void cli_progress_frames(struct cli_progress *progress, uint32_t done, uint32_t total);
/* Shows that `done` of `total` steps of different lengths are finished; `what` is the current one. Without a
 * terminal it prints a line for each step that has taken a second. */
void cli_progress_step(struct cli_progress *progress, uint32_t done, uint32_t total, const char *what);
/* Shows that a progressive picture has `held` samples per pixel; `total` 0: only an interruption ends it. */
void cli_progress_samples(struct cli_progress *progress, uint32_t held, uint32_t total);
/* The largest error of a picture, which is refined until the error is `wanted`, or all pixels have `total`
 * samples. */
struct cli_noise {
    float error, wanted;
    uint32_t held, total;
};
void cli_progress_noise(struct cli_progress *progress, const struct cli_noise *noise);
/* Logs a finished picture: its number, seconds, the maximum memory of the command and its children so far, and
 * its file. Prints nothing if there is a bar. */
void cli_progress_frame(struct cli_progress *progress, uint32_t frame, double seconds, const char *path);
/* Removes the bar, so that other output can be written. */
void cli_progress_clear(struct cli_progress *progress);
/* Keeps the bar of a finished command, and removes any other. */
void cli_progress_end(struct cli_progress *progress, bool done);

#endif
