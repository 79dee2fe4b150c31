/* SPDX-License-Identifier: MIT */
/* Which daemon is asked, and the way to it. */
#include "cli/cli.h"

#include <stdlib.h>

enum { KEY_KEY = 0x400, KEY_LINK };

static const struct argp_option options[] = {
    {"server", 's', "ADDRESS", 0, "unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET] (default: FARLIGHT_SERVER)", 0},
    {"key", KEY_KEY, "FILE", 0,
     "Key that the daemon has as well: the connection is sealed (default for tcp: FARLIGHT_KEY)", 0},
    {"link", KEY_LINK, "RATE,ROUND-TRIP,RESETS", 0, CLI_LINK_HELP, 0},
    {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct cli_daemon *daemon = state->input;
    if (key != 's' && key != KEY_KEY && key != KEY_LINK)
        return ARGP_ERR_UNKNOWN;
    *(key == 's' ? &daemon->server : key == KEY_KEY ? &daemon->key_file : &daemon->link) = value;
    return 0;
}

const struct argp cli_daemon_argp = {.options = options, .parser = parse};

/* NULL: neither; an empty one is none. */
static const char *typed_or_usual(const char *typed, const char *variable)
{
    const char *value = typed ? typed : getenv(variable);
    return value && value[0] != '\0' ? value : NULL;
}

struct fl_connection *cli_daemon_connect(const struct cli_daemon *daemon, const char *name, bool must_be_named,
                                         struct fl_error *error)
{
    const char *server = typed_or_usual(daemon->server, "FARLIGHT_SERVER");
    if (!server && must_be_named) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--server", "no address of a daemon is given");
        fl_error_remedy(error, "give unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET]");
        return NULL;
    }
    if (!cli_interrupt_begin(error))
        return NULL;
    return fl_connect(&(struct fl_connect_options){.server = server,
                                                   .key_file = cli_key_file(server, daemon->key_file),
                                                   .link = typed_or_usual(daemon->link, "FARLIGHT_LINK"),
                                                   .name = name,
                                                   .interrupt_fd = cli_interrupt_fd()},
                      error);
}
