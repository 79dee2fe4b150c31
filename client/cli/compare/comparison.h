/* SPDX-License-Identifier: MIT */
/* The figures of a comparison of two images: printed, as JSON, and checked against limits. */
#ifndef FARLIGHT_CLI_COMPARE_COMPARISON_H
#define FARLIGHT_CLI_COMPARE_COMPARISON_H

#include "lib/farlight.h"

#include <jansson.h>
#include <stdio.h>

/* For most a greater value is worse; for PSNR and SSIM a smaller one. */
enum cli_figure {
    CLI_FIGURE_PSNR,        /* dB */
    CLI_FIGURE_SHOWN_PSNR,  /* dB, of what a screen shows */
    CLI_FIGURE_MEAN,        /* mean error */
    CLI_FIGURE_RMS,         /* root mean square error */
    CLI_FIGURE_MAX,         /* maximum error; the figure of a limit without a name */
    CLI_FIGURE_BEYOND,      /* share of the pixels beyond the threshold */
    CLI_FIGURE_SSIM,        /* structural similarity */
    CLI_FIGURE_BUTTERAUGLI, /* 3-norm */
    CLI_FIGURE_VISIBLE,     /* share of the pixels with a Butteraugli distance above 1 */
    CLI_FIGURE_NONFINITE,   /* share of the pixels with NaN or infinity */
    CLI_FIGURE_COUNT
};

struct cli_limit {
    enum cli_figure figure;
    double value;
};

#define CLI_LIMITS_MAX 32u

struct cli_limits {
    struct cli_limit limits[CLI_LIMITS_MAX];
    size_t count;
};

/* "0.001" or "0.1%". False: as below. */
bool cli_share_parse(const char *text, double *share, struct fl_error *error);
/* Adds "FIGURE=VALUE" or "VALUE"; shares may end in '%'. False: *error says what is wrong, its field empty. */
bool cli_limits_add(struct cli_limits *limits, const char *text, struct fl_error *error);
/* Whether no figure exceeds its limit. A figure that was not measured does; and if there are limits but none for
 * pixels that are not finite, so does any such pixel: the other figures do not count it. */
bool cli_limits_hold(const struct cli_limits *limits, const struct fl_comparison *comparison);

/* One line per figure, and one for each limit that is exceeded. */
void cli_comparison_print(FILE *out, const struct fl_comparison *comparison, const struct cli_limits *limits);
/* The same as an object; figures that were not measured, and PSNR without any error, are null. NULL: out of
 * memory. */
json_t *cli_comparison_json(const struct fl_comparison *comparison, const struct cli_limits *limits);

/* cli_report() of `compare`, where 1 is an answer, as with cmp and diff, so that errors are 2. */
int cli_trouble(const struct fl_error *error);

#endif
