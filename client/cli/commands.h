/* SPDX-License-Identifier: MIT */
/* Subcommands that need no daemon. argv[0] is "farlight NAME". They return the exit status. */
#ifndef FARLIGHT_CLI_COMMANDS_H
#define FARLIGHT_CLI_COMMANDS_H

int cli_info(int argc, char **argv);
int cli_view(int argc, char **argv);
int cli_tracers(int argc, char **argv);
int cli_complete(int argc, char **argv); /* lists values of an option, for the shell */

#endif
