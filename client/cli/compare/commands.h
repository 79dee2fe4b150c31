/* SPDX-License-Identifier: MIT */
/* Subcommands that compare. argv[0] is "farlight NAME". They return the exit status. */
#ifndef FARLIGHT_CLI_COMPARE_COMMANDS_H
#define FARLIGHT_CLI_COMPARE_COMMANDS_H

int cli_compare(int argc, char **argv);
int cli_compare_tracers(int argc, char **argv); /* run by cli_compare for --tracers */
/* Run by cli_compare for --stereo and other pictures from depth layers */
int cli_compare_views(int argc, char **argv);

#endif
