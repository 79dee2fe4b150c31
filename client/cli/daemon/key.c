/* SPDX-License-Identifier: MIT */
/* Keys of sealed connections. */
#include "commands.h"
#include "options/job.h"
#include "options/parse.h"
#include "options/talk.h"

#include "protocol/sealed/key.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

struct key_options {
    const char *path;
    struct cli_job job; /* holds the error of the arguments */
};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct key_options *wanted = state->input;
    if (key != ARGP_KEY_ARG)
        return ARGP_ERR_UNKNOWN;
    if (wanted->path)
        return cli_usage(&wanted->job, value, "only one file can be given");
    wanted->path = value;
    return 0;
}

int cli_key(int argc, char **argv)
{
    static const struct argp argp = {
        .parser = parse,
        .args_doc = "FILE",
        .doc = "Create a key: 32 random bytes in a new file of mode 0600. A daemon with this key (farlightd "
               "--key-file) "
               "accepts clients with a copy of it (--key) from any host, on sealed connections."};
    struct key_options wanted = {0};
    if (cli_parse(&argp, argc, argv, 0, &wanted) != 0)
        return cli_report(&wanted.job.error);
    if (!wanted.path) {
        cli_usage(&wanted.job, "FILE", "a file name is needed");
        return cli_report(&wanted.job.error);
    }
    struct decode_error why = {0};
    struct fl_error error = {0};
    if (sealed_key_create(wanted.path, &why))
        return CLI_DONE;
    fl_error_set(&error, FL_ERROR_FILE, wanted.path, "%s", why.text);
    return cli_report(&error);
}
