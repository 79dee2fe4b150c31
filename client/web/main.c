/* SPDX-License-Identifier: MIT */
/* farlight-web: a page in a browser that shows a shared scene of a daemon. */
#include "cli/cli.h"
#include "lib/text.h"
#include "web/gateway.h"
#include "protocol/version.h"

#include <stdlib.h>

/* The C library looks for it by name, past our hidden visibility. */
__attribute__((visibility("default"))) const char *argp_program_version = "farlight-web " FARLIGHT_VERSION;

#define LISTEN_DEFAULT "127.0.0.1:8080"
#define VIEWERS_DEFAULT 8u
#define VIEWERS_MAX 64u

enum key { KEY_SCENE = 0x500, KEY_LISTEN, KEY_INSECURE, KEY_VIEWERS };

static const struct argp_option options[] = {
    {"scene", KEY_SCENE, "NAME", 0, "Show this shared scene of the daemon ('farlight scenes' lists them)", 0},
    {"listen", KEY_LISTEN, "HOST:PORT", 0,
     "Serve the page here, at an IPv4 address of this machine (default " LISTEN_DEFAULT "; port 0: any free one)",
     0},
    {"insecure", KEY_INSECURE, NULL, 0,
     "Let --listen be beyond this machine: who can read the network's traffic gets the link and the pictures", 0},
    {"viewers", KEY_VIEWERS, "N", 0, "Let N browsers look at once, 1 to 64 (default 8)", 0},
    {0}};

struct command_line {
    struct cli_daemon daemon;
    struct cli_job job; /* has the error of what was typed */
    const char *scene, *listen;
    bool insecure;
    uint64_t viewers;
};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct command_line *line = state->input;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = &line->daemon;
        return 0;
    case KEY_SCENE:
        line->scene = value;
        return 0;
    case KEY_LISTEN:
        line->listen = value;
        return 0;
    case KEY_INSECURE:
        line->insecure = true;
        return 0;
    case KEY_VIEWERS:
        return fl_text_integer(value, 1, VIEWERS_MAX, &line->viewers, &line->job.error)
                   ? 0
                   : cli_usage(&line->job, "--viewers", "'%s' is no number from 1 to %u", value, VIEWERS_MAX);
    case ARGP_KEY_ARG:
        return cli_usage(&line->job, value,
                         "is not expected; share a model with 'farlight serve', and name its scene with --scene");
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* An empty one is none. */
static const char *usual(const char *typed, const char *variable)
{
    const char *value = typed ? typed : getenv(variable);
    return value && value[0] != '\0' ? value : NULL;
}

static bool complete(struct command_line *line, struct gateway_options *gateway, struct fl_error *error)
{
    bool is_loopback = false;
    const char *server = usual(line->daemon.server, "FARLIGHT_SERVER");
    if (!server) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--server", "no address of a daemon is given");
        return fl_error_remedy(error, "'farlight serve MODEL' shares a model and prints its address");
    }
    if (!line->scene) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--scene", "no scene is given");
        return fl_error_remedy(error, "'farlight scenes --server %s' lists them", server);
    }
    if (!gateway_read_listen(line->listen, gateway, &is_loopback, error))
        return false;
    if (!is_loopback && !line->insecure) {
        fl_error_set(
            error, FL_ERROR_ARGUMENT, "--listen",
            "%s is beyond this machine, where all traffic, the link with its token included, is unencrypted",
            gateway->host);
        return fl_error_remedy(error,
                               "keep 127.0.0.1 and come by 'ssh -L %d:127.0.0.1:%d HOST' or through a TLS "
                               "proxy on this machine; --insecure listens there nevertheless",
                               gateway->port, gateway->port);
    }
    gateway->seat = (struct seat_options){.server = server,
                                          .key_file = cli_key_file(server, line->daemon.key_file),
                                          .link = usual(line->daemon.link, "FARLIGHT_LINK"),
                                          .scene = line->scene};
    gateway->viewers = (unsigned)line->viewers;
    gateway->interrupt_signal = cli_interrupt_signal;
    return true;
}

/* A wrong name or address is better told here than in a browser. */
static bool check_scene(const struct seat_options *seat, struct fl_error *error)
{
    const struct fl_connect_options connect = {.server = seat->server,
                                               .key_file = seat->key_file,
                                               .link = seat->link,
                                               .name = "farlight-web",
                                               .interrupt_fd = cli_interrupt_fd()};
    struct fl_connection *connection = fl_connect(&connect, error);
    struct fl_scene *scene = connection ? fl_scene_attach(connection, seat->scene, error) : NULL;
    const bool is_there = scene != NULL;
    fl_scene_destroy(scene);
    fl_connection_destroy(connection);
    return is_there;
}

int main(int argc, char **argv)
{
    static struct argp_child children[2];
    children[0].argp = &cli_daemon_argp;
    static const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "--server ADDRESS --scene NAME",
        .doc =
            "Show a shared scene of a daemon in browsers: prints a link, and serves who has it until Ctrl-C.\v"
            "The link has a random token; who has it can look, and change nothing. Each browser has a view of its "
            "own.",
        .children = children};
    struct command_line line = {.listen = LISTEN_DEFAULT, .viewers = VIEWERS_DEFAULT};
    struct gateway_options gateway = {0};
    struct fl_error error = {0};
    argp_err_exit_status = CLI_USAGE;
    if (cli_parse(&argp, argc, argv, 0, &line) != 0)
        return cli_report(&line.job.error);
    if (!complete(&line, &gateway, &error) || !cli_interrupt_begin(&error) || !check_scene(&gateway.seat, &error))
        return cli_report(&error);
    gateway_run(&gateway, &error);
    return cli_report(&error);
}
