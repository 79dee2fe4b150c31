/* SPDX-License-Identifier: MIT */
/* Command lines: argp's parser, which names the option that was probably meant. */
#ifndef FARLIGHT_OPTIONS_PARSE_H
#define FARLIGHT_OPTIONS_PARSE_H

#include <argp.h>

/* argp_parse(), which ends the program after a mistake, and tells which option was probably meant. */
error_t cli_parse(const struct argp *argp, int argc, char **argv, unsigned flags, void *input);

#endif
