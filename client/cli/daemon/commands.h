/* SPDX-License-Identifier: MIT */
/* Subcommands about daemons and their scenes. argv[0] is "farlight NAME". They return the exit status. */
#ifndef FARLIGHT_CLI_DAEMON_COMMANDS_H
#define FARLIGHT_CLI_DAEMON_COMMANDS_H

int cli_serve(int argc, char **argv);
int cli_scenes(int argc, char **argv);
int cli_edit(int argc, char **argv);
int cli_stats(int argc, char **argv);
int cli_ping(int argc, char **argv);
int cli_bridge(int argc, char **argv);
int cli_key(int argc, char **argv);

#endif
