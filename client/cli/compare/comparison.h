/* SPDX-License-Identifier: MIT */
/* Figures of a comparison of two images: printed, as JSON, and checked against limits. */
#ifndef FARLIGHT_CLI_COMPARE_COMPARISON_H
#define FARLIGHT_CLI_COMPARE_COMPARISON_H

#include "lib/farlight.h"

#include <jansson.h>
#include <stdio.h>

/* The figures. For most a greater value is worse; for PSNR and SSIM a smaller one. */
enum cli_figure {
    CLI_FIGURE_PSNR,        /* dB */
    CLI_FIGURE_SHOWN_PSNR,  /* dB, for displayed colours */
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

/* Reads "0.001" or "0.1%". False: *error has the reason, its field empty. */
bool cli_share_parse(const char *text, double *share, struct fl_error *error);
/* Adds "FIGURE=VALUE" or "VALUE"; shares may end with '%'. False: *error has the reason, its field empty. */
bool cli_limits_add(struct cli_limits *limits, const char *text, struct fl_error *error);
/* True if all figures are within their limits. A figure that was not measured exceeds its limit; and if there
 * are limits but none for pixels that are not finite, any such pixel exceeds it, because other figures ignore
 * it. */
bool cli_limits_hold(const struct cli_limits *limits, const struct fl_comparison *comparison);

/* Prints a line for each figure, and one for each exceeded limit. */
void cli_comparison_print(FILE *out, const struct fl_comparison *comparison, const struct cli_limits *limits);
/* Makes the same as an object; figures that were not measured, and PSNR without any error, are null. NULL: out
 * of memory. */
json_t *cli_comparison_json(const struct fl_comparison *comparison, const struct cli_limits *limits);

/* Reports an error of `compare`, whose status is 2, since 1 is an answer, as with cmp and diff. */
int cli_trouble(const struct fl_error *error);

#endif
