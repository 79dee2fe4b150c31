/* SPDX-License-Identifier: MIT */
/* Subcommands that make pictures. argv[0] is "farlight NAME". They return the exit status. */
#ifndef FARLIGHT_CLI_JOBS_COMMANDS_H
#define FARLIGHT_CLI_JOBS_COMMANDS_H

int cli_render(int argc, char **argv);
int cli_animate(int argc, char **argv);
int cli_turntable(int argc, char **argv);
int cli_thumbnail(int argc, char **argv);
int cli_verify(int argc, char **argv);
int cli_merge(int argc, char **argv);

#endif
