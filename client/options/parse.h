/* SPDX-License-Identifier: MIT */
/* Parsing of command lines with argp, and suggestions for misspelt options. */
#ifndef FARLIGHT_OPTIONS_PARSE_H
#define FARLIGHT_OPTIONS_PARSE_H

#include <argp.h>

/* Calls argp_parse(), which ends the program after a mistake, and suggests the option that was probably meant. */
error_t cli_parse(const struct argp *argp, int argc, char **argv, unsigned flags, void *input);

#endif
