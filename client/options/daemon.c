/* SPDX-License-Identifier: MIT */
/* The daemon of a command: its address, its key, and connecting. */
#include "daemon.h"
#include "interrupt.h"
#include "talk.h"
#include "protocol/common/clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { KEY_KEY = 0x400, KEY_RETRY_FOR, KEY_LOST_AFTER };

static const struct argp_option options[] = {
    {"server", 's', "ADDRESS", 0, "unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET] (default: FARLIGHT_SERVER)", 0},
    {"key", KEY_KEY, "FILE", 0,
     "Key shared with the daemon, which seals the connection (default for tcp: FARLIGHT_KEY)", 0},
    {"retry-for", KEY_RETRY_FOR, "DURATION", 0,
     "Wait this long for a daemon that is not running, in seconds or as 5m or 2h (default 0)", 0},
    {"lost-after", KEY_LOST_AFTER, "DURATION", 0,
     "Regard a daemon as lost if it answers nothing for this long, not even a ping (default 1m)", 0},
    {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct cli_daemon *daemon = state->input;
    struct fl_error error = {0};
    if (key == KEY_RETRY_FOR && !cli_read_retry_for(value, &daemon->retries, &error))
        argp_failure(state, CLI_USAGE, 0, "--retry-for: %s", error.text);
    if (key == KEY_LOST_AFTER && !cli_read_lost_after(value, &daemon->retries, &error))
        argp_failure(state, CLI_USAGE, 0, "--lost-after: %s", error.text);
    if (key == KEY_RETRY_FOR || key == KEY_LOST_AFTER)
        return 0;
    if (key != 's' && key != KEY_KEY)
        return ARGP_ERR_UNKNOWN;
    *(key == 's' ? &daemon->server : &daemon->key_file) = value;
    return 0;
}

const struct argp cli_daemon_argp = {.options = options, .parser = parse};

const char *cli_key_file(const char *server, const char *given)
{
    const char *usual = getenv("FARLIGHT_KEY");
    const bool is_tcp = server && strncmp(server, "tcp:", 4) == 0;
    return !given && is_tcp && usual && usual[0] != '\0' ? usual : given;
}

/* The option, or the variable if it is missing; empty counts as missing. NULL: neither. */
static const char *typed_or_usual(const char *typed, const char *variable)
{
    const char *value = typed ? typed : getenv(variable);
    return value && value[0] != '\0' ? value : NULL;
}

/* Tries until a daemon answers, the error is final, or the time is over. */
static struct fl_connection *connect_within(struct fl_connect_options wanted, double for_s, struct fl_error *error)
{
    const uint64_t begin_ns = monotonic_now_ns();
    for (unsigned failures = 1;; failures++) {
        double left_s = for_s - (double)(monotonic_now_ns() - begin_ns) * 1e-9;
        wanted.timeout_ms = cli_connect_timeout_ms(left_s);
        *error = (struct fl_error){0};
        struct fl_connection *connection = fl_connect(&wanted, error);
        left_s = for_s - (double)(monotonic_now_ns() - begin_ns) * 1e-9;
        if (connection || !cli_is_temporary(error) || left_s <= 0)
            return connection;
        const double pause_ms = cli_retry_pause_ms(failures, error->retry_after_ms);
        if (!cli_retry_wait((uint32_t)fmin(pause_ms, left_s * 1e3) + 1, error))
            return NULL;
    }
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
    const struct fl_connect_options wanted = {.server = server,
                                              .key_file = cli_key_file(server, daemon->key_file),
                                              .name = name,
                                              .interrupt_fd = cli_interrupt_fd(),
                                              .lost_after_ms = daemon->retries.lost_after_ms};
    return daemon->retries.has_duration ? connect_within(wanted, daemon->retries.for_s, error)
                                        : fl_connect(&wanted, error);
}
