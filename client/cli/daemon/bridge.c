/* SPDX-License-Identifier: MIT */
/* farlight bridge: the program that ssh runs on the daemon's host. */
#include "commands.h"
#include "options/job.h"
#include "options/parse.h"
#include "options/talk.h"

#include <unistd.h>

struct bridge_options {
    const char *address;
    struct cli_job job; /* holds an option's error */
};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct bridge_options *wanted = state->input;
    if (key != ARGP_KEY_ARG)
        return ARGP_ERR_UNKNOWN;
    if (wanted->address)
        return cli_usage(&wanted->job, value, "only one address can be given");
    wanted->address = value;
    return 0;
}

int cli_bridge(int argc, char **argv)
{
    static const struct argp argp = {
        .parser = parse,
        .args_doc = "ADDRESS",
        .doc = "Copy standard input and output to a daemon's socket (unix:PATH or tcp:HOST:PORT). "
               "--server ssh:HOST runs this on HOST."};
    struct bridge_options wanted = {0};
    if (cli_parse(&argp, argc, argv, 0, &wanted) != 0)
        return cli_report(&wanted.job.error);
    if (!wanted.address) {
        cli_usage(&wanted.job, "ADDRESS", "the address of a socket is needed");
        return cli_report(&wanted.job.error);
    }
    struct fl_error error = {0};
    return fl_bridge(wanted.address, STDIN_FILENO, STDOUT_FILENO, &error) ? CLI_DONE : cli_report(&error);
}
