/* SPDX-License-Identifier: MIT */
/* The figures of a comparison of two images: printed, as JSON, and held against limits. */
#ifndef FARLIGHT_CLIENT_CLI_COMPARISON_H
#define FARLIGHT_CLIENT_CLI_COMPARISON_H

#include "lib/farlight.h"

#include <jansson.h>
#include <stdio.h>

/* Of most a greater value is worse; of PSNR and SSIM a smaller one. */
enum cli_figure {
    CLI_FIGURE_PSNR,        /* dB */
    CLI_FIGURE_MEAN,        /* mean error */
    CLI_FIGURE_RMS,         /* root mean square error */
    CLI_FIGURE_MAX,         /* greatest error; what a limit without a name is about */
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
/* Whether nothing is worse than its limit. A figure that was not measured is; and where there are limits but none
 * for pixels that are not finite, so is any such pixel: the other figures know nothing of it. */
bool cli_limits_hold(const struct cli_limits *limits, const struct fl_comparison *comparison);

/* A line a figure, and one for each limit that does not hold. */
void cli_comparison_print(FILE *out, const struct fl_comparison *comparison, const struct cli_limits *limits);
/* The same as an object; what was not measured, and PSNR without any error, is null. NULL: out of memory. */
json_t *cli_comparison_json(const struct fl_comparison *comparison, const struct cli_limits *limits);

#endif
