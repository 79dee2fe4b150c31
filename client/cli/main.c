/* SPDX-License-Identifier: MIT */
/* farlight: the command line, and its subcommands. */
#include "commands.h"
#include "cli/compare/commands.h"
#include "cli/daemon/commands.h"
#include "cli/jobs/commands.h"
#include "options/talk.h"
#include "lib/text.h"
#include "protocol/common/standard.h"
#include "protocol/version.h"

#include <argp.h>
#include <stdio.h>
#include <string.h>

static const struct subcommand {
    const char *name;
    char title[20]; /* argv[0] of the subcommand */
    int (*run)(int argc, char **argv);
    const char *doc;
} subcommands[] = {
    {"render", "farlight render", cli_render, "render one picture of a model"},
    {"animate", "farlight animate", cli_animate, "render a series of pictures or a video"},
    {"turntable", "farlight turntable", cli_turntable, "render a full turn of the camera around a model"},
    {"thumbnail", "farlight thumbnail", cli_thumbnail, "render a contact sheet of many models"},
    {"view", "farlight view", cli_view, "open a window on a model or a shared scene"},
    {"info", "farlight info", cli_info, "show what a model file contains"},
    {"compare", "farlight compare", cli_compare, "measure the difference of two images or two tracers"},
    {"tracers", "farlight tracers", cli_tracers, "list the tracers and their settings"},
    {"serve", "farlight serve", cli_serve, "share a model for other clients"},
    {"verify", "farlight verify", cli_verify, "check the pictures of an animation against their digests"},
    {"merge", "farlight merge", cli_merge, "join the parts of a picture that several hosts rendered"},
    {"scenes", "farlight scenes", cli_scenes, "list the scenes of a daemon to which clients may attach"},
    {"edit", "farlight edit", cli_edit, "change materials, nodes and lights of a shared scene"},
    {"stats", "farlight stats", cli_stats, "show a daemon's clients, scenes, memory and times"},
    {"ping", "farlight ping", cli_ping, "measure the round-trip time to a daemon"},
    {"key", "farlight key", cli_key, "create a key for sealed connections"},
    {"bridge", "farlight bridge", cli_bridge, "copy standard input and output to a daemon's socket"},
};
#define SUBCOMMAND_COUNT (sizeof(subcommands) / sizeof(subcommands[0]))

static void print_help(FILE *out)
{
    fputs("Usage: farlight SUBCOMMAND [OPTION...]\nRay-trace models with a farlight daemon.\n\n", out);
    for (size_t i = 0; i < SUBCOMMAND_COUNT; i++)
        fprintf(out, "  %-9s %s\n", subcommands[i].name, subcommands[i].doc);
    fputs("  help      show this text; 'farlight help SUBCOMMAND' lists options\n\n"
          "'farlight --version' prints the version.\n"
          "Exit status: 0 success, 1 failure, 2 wrong usage, 75 try again later, 130 and 143 interrupted.\n",
          out);
}

static const struct subcommand *find(const char *name)
{
    for (size_t i = 0; i < SUBCOMMAND_COUNT; i++)
        if (strcmp(subcommands[i].name, name) == 0)
            return &subcommands[i];
    return NULL;
}

static int run(const struct subcommand *subcommand, int argc, char **argv)
{
    char title[sizeof(subcommand->title)];
    memcpy(title, subcommand->title, sizeof(title));
    argv[0] = title;
    return subcommand->run(argc, argv);
}

static int unknown(const char *name)
{
    struct fl_error error;
    fl_error_set(&error, FL_ERROR_ARGUMENT, name, "is not a subcommand");
    struct fl_nearest nearest = {0};
    for (size_t i = 0; i < SUBCOMMAND_COUNT; i++)
        fl_nearest_try(&nearest, name, subcommands[i].name);
    fl_nearest_try(&nearest, name, "help");
    if (nearest.name)
        fl_error_remedy(&error, "did you mean '%s'?", nearest.name);
    else
        fl_error_remedy(&error, "'farlight help' lists all subcommands");
    return cli_report(&error);
}

static int help(int argc, char **argv)
{
    char option[] = "--help";
    if (argc < 3 || strcmp(argv[2], "help") == 0) {
        print_help(stdout);
        return CLI_DONE;
    }
    const struct subcommand *subcommand = find(argv[2]);
    if (!subcommand)
        return unknown(argv[2]);
    char *arguments[] = {NULL, option, NULL};
    return run(subcommand, 2, arguments);
}

int main(int argc, char **argv)
{
    argp_err_exit_status = CLI_USAGE;
    open_standard_descriptors();
    if (argc < 2) {
        print_help(stderr);
        return CLI_USAGE;
    }
    if (strcmp(argv[1], "help") == 0 || strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-?") == 0)
        return help(argc, argv);
    if (strcmp(argv[1], "--version") == 0 || strcmp(argv[1], "-V") == 0) {
        puts("farlight " FARLIGHT_VERSION);
        return CLI_DONE;
    }
    const struct subcommand *subcommand = find(argv[1]);
    int status = CLI_USAGE;
    if (strcmp(argv[1], "complete") == 0)
        status = cli_complete(argc - 1, argv + 1);
    else if (subcommand)
        status = run(subcommand, argc - 1, argv + 1);
    else
        status = unknown(argv[1]);
    /* A failed write of the output fails the command; a full disk shows only here. */
    if (fflush(stdout) != 0 && (status == CLI_DONE || status == CLI_FAILED)) {
        fprintf(stderr, "farlight: standard output cannot be written: %m\n");
        status = subcommand && subcommand->run == cli_compare ? CLI_TROUBLE : CLI_FAILED;
    }
    return status;
}
