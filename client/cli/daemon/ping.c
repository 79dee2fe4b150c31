/* SPDX-License-Identifier: MIT */
/* farlight ping: measures the round-trip time to a daemon. */
#include "commands.h"
#include "options/daemon.h"
#include "options/job.h"
#include "options/parse.h"
#include "options/talk.h"
#include "lib/text.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>

struct ping_options {
    struct cli_daemon daemon;
    uint64_t count;
    struct cli_job job; /* holds an option's error */
};

static const struct argp_option options[] = {{"count", 'c', "N", 0, "Measure N times (default 5)", 0}, {0}};

static const struct argp_child children[] = {{&cli_daemon_argp, 0, NULL, 0}, {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct ping_options *wanted = state->input;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = &wanted->daemon;
        return 0;
    case 'c':
        if (fl_text_integer(value, 1, 1000000, &wanted->count, &wanted->job.error))
            return 0;
        snprintf(wanted->job.error.field, sizeof(wanted->job.error.field), "--count");
        return EINVAL;
    case ARGP_KEY_ARG:
        return cli_usage(&wanted->job, value, "is an argument too many");
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static bool ping(struct fl_connection *connection, const struct ping_options *wanted, struct fl_error *error)
{
    uint64_t min_ns = UINT64_MAX, max_ns = 0, sum_ns = 0;
    for (uint64_t i = 0; i < wanted->count; i++) {
        uint64_t ns = 0;
        if (!fl_ping(connection, &ns, error))
            return false;
        min_ns = ns < min_ns ? ns : min_ns;
        max_ns = ns > max_ns ? ns : max_ns;
        sum_ns += ns;
    }
    printf("%s: %" PRIu64 " round trips, minimum %.3f ms, mean %.3f ms, maximum %.3f ms\n",
           fl_connection_address(connection), wanted->count, (double)min_ns * 1e-6,
           (double)sum_ns * 1e-6 / (double)wanted->count, (double)max_ns * 1e-6);
    return true;
}

int cli_ping(int argc, char **argv)
{
    static const struct argp argp = {.options = options,
                                     .parser = parse,
                                     .children = children,
                                     .doc = "Measure the round-trip time to a daemon."};
    struct ping_options wanted = {.count = 5};
    if (cli_parse(&argp, argc, argv, 0, &wanted) != 0)
        return cli_report(&wanted.job.error);
    struct fl_error error = {0};
    struct fl_connection *connection = cli_daemon_connect(&wanted.daemon, "farlight ping", false, &error);
    const bool done = connection && ping(connection, &wanted, &error);
    fl_connection_destroy(connection);
    return done ? CLI_DONE : cli_report(&error);
}
