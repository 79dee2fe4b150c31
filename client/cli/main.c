/* SPDX-License-Identifier: MIT */
#include "cli/cli.h"
#include "protocol/version.h"

#include <stdio.h>
#include <string.h>

static const struct subcommand {
    const char *name;
    char title[20]; /* argv[0] of the subcommand */
    int (*run)(int argc, char **argv);
    const char *doc;
} subcommands[] = {
    {"render", "farlight render", cli_render, "one picture of a model"},
    {"animate", "farlight animate", cli_animate, "a series of pictures along a camera's path"},
    {"view", "farlight view", cli_view, "a window on a scene that is rendered elsewhere"},
    {"info", "farlight info", cli_info, "what a model file holds"},
    {"compare", "farlight compare", cli_compare, "how far two images are apart, or two tracers"},
    {"serve", "farlight serve", cli_serve, "puts a model up for others"},
    {"scenes", "farlight scenes", cli_scenes, "which scenes a daemon has that others may come to"},
    {"stats", "farlight stats", cli_stats, "what a daemon has and does"},
    {"ping", "farlight ping", cli_ping, "the way to a daemon and back"},
    {"key", "farlight key", cli_key, "a new key for sealed connections"},
    {"bridge", "farlight bridge", cli_bridge, "what ssh runs on the daemon's host"},
};
#define SUBCOMMAND_COUNT (sizeof(subcommands) / sizeof(subcommands[0]))

static void print_help(FILE *out)
{
    fputs("Usage: farlight SUBCOMMAND [OPTION...]\nRay-trace models with a farlight daemon.\n\n", out);
    for (size_t i = 0; i < SUBCOMMAND_COUNT; i++)
        fprintf(out, "  %-9s %s\n", subcommands[i].name, subcommands[i].doc);
    fputs("  help      this text; 'farlight help SUBCOMMAND' lists its options\n\n"
          "'farlight --version' prints the version.\n"
          "Exit status: 0 done, 1 failed, 2 wrong usage, 75 try again later, 130 and 143 interrupted.\n",
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

static int help(int argc, char **argv)
{
    char option[] = "--help";
    const struct subcommand *subcommand = argc > 2 ? find(argv[2]) : NULL;
    if (!subcommand) {
        print_help(stdout);
        return CLI_DONE;
    }
    char *arguments[] = {NULL, option, NULL};
    return run(subcommand, 2, arguments);
}

static int unknown(const char *name)
{
    struct fl_error error;
    fl_error_set(&error, FL_ERROR_ARGUMENT, name, "is no subcommand");
    fl_error_remedy(&error, "'farlight help' lists them");
    return cli_report(&error);
}

int main(int argc, char **argv)
{
    argp_err_exit_status = CLI_USAGE;
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
    if (subcommand)
        status = run(subcommand, argc - 1, argv + 1);
    else
        status = unknown(argv[1]);
    /* What was printed must have arrived, or the command has failed: a full disk shows only here. */
    if (fflush(stdout) != 0 && (status == CLI_DONE || status == CLI_FAILED)) {
        fprintf(stderr, "farlight: standard output cannot be written: %m\n");
        status = subcommand && subcommand->run == cli_compare ? CLI_TROUBLE : CLI_FAILED;
    }
    return status;
}
