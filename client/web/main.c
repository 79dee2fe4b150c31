/* SPDX-License-Identifier: MIT */
/* farlight-web: a page in a browser that shows a model, or a shared scene of a daemon. */
#include "options/sharing.h"
#include "options/watch.h"
#include "lib/text.h"
#include "web/gateway.h"
#include "protocol/common/standard.h"
#include "protocol/version.h"
#include "options/arguments.h"
#include "options/complete.h"
#include "options/daemon.h"
#include "options/image_path.h"
#include "options/interrupt.h"
#include "options/job.h"
#include "options/models.h"
#include "options/parse.h"
#include "options/talk.h"

#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* argp finds this variable by name, despite our hidden visibility. */
__attribute__((visibility("default"))) const char *argp_program_version = "farlight-web " FARLIGHT_VERSION;

#define LISTEN_DEFAULT "127.0.0.1:8080"
#define VIEWERS_DEFAULT 8u
#define VIEWERS_MAX 64u
#define DAEMON_WORDS_MAX 28 /* limit of fl_connect */

enum key {
    KEY_SCENE = 0x500,
    KEY_LISTEN,
    KEY_HOST,
    KEY_INSECURE,
    KEY_VIEWERS,
    KEY_WATCH,
    KEY_ALLOW_EDIT,
    KEY_SAMPLES,
    KEY_INTEGRATOR
};

static const struct argp_option options[] = {
    {NULL, 0, NULL, 0, "Page:", -2},
    {"scene", KEY_SCENE, "NAME", 0,
     "Show a shared scene at --server in place of MODEL ('farlight scenes' lists them)", -2},
    {"listen", KEY_LISTEN, "HOST:PORT", 0,
     "Serve the page here, as 127.0.0.1:8080 (default), [::1]:8080, or [::]:8080 for all of this machine; port 0: "
     "any free one; may be repeated",
     -2},
    {"host", KEY_HOST, "NAME", 0,
     "Answer requests to this host name, such as a proxy's; may be repeated (addresses and localhost are "
     "always "
     "answered)",
     -2},
    {"insecure", KEY_INSECURE, NULL, 0,
     "Allow --listen beyond this machine: readers of the network's traffic get the link and the pictures", -2},
    {"viewers", KEY_VIEWERS, "N", 0, "Serve at most N browsers at a time, 1 to 64 (default 8)", -2},
    {"allow-edit", KEY_ALLOW_EDIT, NULL, 0,
     "Print a second link, whose users may edit the scene for all who view it", -2},
    {"watch", KEY_WATCH, NULL, 0, "Load the model again when it, or a file that it names, has changed", -2},
    {"samples", KEY_SAMPLES, "N", 0, "Render N samples per pixel while nothing moves (default 64)", -2},
    {"integrator", KEY_INTEGRATOR, "NAME", 0,
     "Begin with whitted (default), distributed (default with a lens or a shutter), raycast, ao or path", -2},
    {0}};

struct command_line {
    struct cli_job job; /* model, server, options of the picture; and the error of an option */
    struct gateway_options gateway;
    bool insecure;
    struct cli_socket socket;
    struct web_outage outage;
    const char *words[DAEMON_WORDS_MAX + 1]; /* arguments of a private daemon, and a NULL */
    size_t word_count;
};

/* ---- command line ---- */

static error_t add_word(struct command_line *line, const char *word)
{
    if (line->word_count == DAEMON_WORDS_MAX)
        return cli_usage(&line->job, word, "too many options for the daemon");
    line->words[line->word_count++] = word;
    return 0;
}

static error_t add_listen(struct command_line *line, const char *value)
{
    struct gateway_options *gateway = &line->gateway;
    if (gateway->listen_count == GATEWAY_LISTENS_MAX)
        return cli_usage(&line->job, "--listen", "at most %d addresses can be given", GATEWAY_LISTENS_MAX);
    return web_address_read(value, &gateway->listens[gateway->listen_count++], &line->job.error) ? 0 : EINVAL;
}

static error_t add_host(struct command_line *line, const char *value)
{
    struct gateway_options *gateway = &line->gateway;
    if (gateway->host_count == GATEWAY_HOSTS_MAX)
        return cli_usage(&line->job, "--host", "at most %d names can be given", GATEWAY_HOSTS_MAX);
    if (value[0] == '\0' || strpbrk(value, ":/ "))
        return cli_usage(&line->job, "--host", "'%s' is no name: leave scheme and port out", value);
    gateway->hosts[gateway->host_count++] = value;
    return 0;
}

static error_t set_number(struct command_line *line, const char *field, const char *value, uint64_t max,
                          unsigned *out)
{
    uint64_t number = 0;
    if (!fl_text_integer(value, 1, max, &number, &line->job.error))
        return cli_usage(&line->job, field, "'%s' is no number from 1 to %llu", value, (unsigned long long)max);
    *out = (unsigned)number;
    return 0;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct command_line *line = state->input;
    struct cli_job *job = &line->job;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = job;
        return 0;
    case KEY_SCENE:
        job->input.scene = value;
        return 0;
    case KEY_LISTEN:
        return add_listen(line, value);
    case KEY_HOST:
        return add_host(line, value);
    case KEY_INSECURE:
        line->insecure = true;
        return 0;
    case KEY_WATCH:
        job->input.watch = true;
        return 0;
    case KEY_ALLOW_EDIT:
        line->gateway.allow_edit = true;
        return 0;
    case KEY_VIEWERS:
        return set_number(line, "--viewers", value, VIEWERS_MAX, &line->gateway.viewers);
    case KEY_SAMPLES:
        return set_number(line, "--samples", value, 65536, &job->options.sampling.samples);
    case KEY_INTEGRATOR:
        job->given.integrator = true;
        return protocol_integrator_parse(value, &job->options.light.integrator)
                   ? 0
                   : cli_usage(job, "--integrator", "unknown integrator '%s'", value);
    case ARGP_KEY_ARG: /* words after -- are the daemon's */
        return state->quoted > 0 && state->next > state->quoted ? add_word(line, value)
                                                                : cli_set_model(job, value);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static bool check_listens(const struct command_line *line, struct fl_error *error)
{
    for (size_t i = 0; i < line->gateway.listen_count; i++) {
        const struct web_address *address = &line->gateway.listens[i];
        if (address->is_loopback || line->insecure)
            continue;
        fl_error_set(
            error, FL_ERROR_ARGUMENT, "--listen",
            "%s is beyond this machine, where all traffic, the link with its token included, is unencrypted",
            address->host);
        return fl_error_remedy(error,
                               "keep 127.0.0.1 and connect by 'ssh -L %d:127.0.0.1:%d HOST' or through a TLS "
                               "proxy on this machine; --insecure listens there nevertheless",
                               address->port, address->port);
    }
    return true;
}

/* Adds an address to the daemon's arguments, since seats connect to it as every client does. The user's
 * arguments come last, because the later of two options counts. */
static bool name_daemon(struct command_line *line, struct fl_error *error)
{
    const char *const ours[] = {"--listen", line->socket.address, "--log-level", "error"};
    const size_t our_count = sizeof(ours) / sizeof(ours[0]);
    if (!cli_socket_choose(&line->socket, error))
        return false;
    if (line->word_count + our_count > DAEMON_WORDS_MAX)
        return fl_error_set(error, FL_ERROR_ARGUMENT, line->words[0], "too many options for the daemon");
    memmove(line->words + our_count, line->words, line->word_count * sizeof(*line->words));
    memcpy(line->words, ours, sizeof(ours));
    return true;
}

/* An empty value, as of FARLIGHT_SERVER=, counts as none. */
static const char *named(const char *text)
{
    return text && text[0] != '\0' ? text : NULL;
}

static bool complete(struct command_line *line, struct fl_error *error)
{
    struct cli_job *job = &line->job;
    job->daemon.server = named(job->daemon.server);
    if (line->gateway.listen_count == 0)
        add_listen(line, LISTEN_DEFAULT);
    if (!job->input.scene && !job->input.model) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "MODEL", "no model and no --scene is given");
        return fl_error_remedy(error, job->daemon.server ? "'farlight scenes' lists the daemon's scenes"
                                                         : "farlight-web model.glb");
    }
    /* A reload keeps the scene and applies the edits again. */
    if (job->input.watch && !cli_watch_can_edit_again(job->input.edits, job->input.edit_count))
        cli_usage(job, "--watch", "an --edit that adds or multiplies would do so each time: assign a value");
    if (job->error.code != FL_ERROR_NONE || !cli_check_watch(job) || !cli_job_complete_view(job) ||
        !cli_check_models(job, &job->error)) {
        *error = job->error;
        return false;
    }
    if (line->word_count > 0 && (job->input.scene || job->daemon.server))
        return fl_error_set(error, FL_ERROR_ARGUMENT, line->words[0],
                            "the daemon at --server already has its options; leave this out");
    if (!check_listens(line, error) || (!job->daemon.server && !name_daemon(line, error)))
        return false;
    const char *server = job->daemon.server ? job->daemon.server : line->socket.address;
    line->gateway.seat =
        (struct seat_options){.job = job,
                              .server = server,
                              .key_file = cli_key_file(server, job->daemon.key_file),
                              .scene = job->input.scene ? job->input.scene : cli_base_name(job->input.model),
                              /* With a private daemon the sharing thread reports outages. */
                              .outage = job->input.model ? NULL : &line->outage};
    line->gateway.interrupt_signal = cli_interrupt_signal;
    return true;
}

/* ---- a scene of the daemon's ---- */

/* Connects once, so that a wrong name, address or camera is reported here rather than in a browser. */
static bool check_scene(const struct seat_options *seat, struct fl_error *error)
{
    const struct fl_connect_options connect = {.server = seat->server,
                                               .key_file = seat->key_file,
                                               .name = "farlight-web",
                                               .interrupt_fd = cli_interrupt_fd()};
    const struct cli_job *job = seat->job;
    struct message_render render = job->options;
    struct fl_connection *connection = fl_connect(&connect, error);
    struct fl_scene *scene = connection ? fl_scene_attach(connection, seat->scene, error) : NULL;
    const bool is_there = scene && cli_find_camera(&render, job->camera.name, job->camera.framed,
                                                   job->camera.has_framing, scene, error);
    fl_scene_destroy(scene);
    fl_connection_destroy(connection);
    return is_there;
}

/* ---- a model ---- */

/* Sharing of a model while the gateway runs, by a thread of its own. */
struct share {
    struct cli_sharing sharing;
    struct fl_error error; /* result of the thread, once it has ended */
    atomic_bool has_ended;
    pthread_t thread;
};

static void *keep_sharing(void *argument)
{
    struct share *share = argument;
    cli_sharing_stay(&share->sharing, &share->error);
    atomic_store(&share->has_ended, true);
    return NULL;
}

static bool has_ended(void *user)
{
    struct share *share = user;
    return atomic_load(&share->has_ended);
}

/* Ctrl-C ends both; if sharing fails, the gateway ends with the process. */
static void run_with(struct gateway *gateway, struct share *share, struct fl_error *error)
{
    if (pthread_create(&share->thread, NULL, keep_sharing, share) != 0) {
        fl_error_set(error, FL_ERROR_SYSTEM, "", "cannot start a thread");
        return;
    }
    gateway_run(gateway, error);
    if (cli_interrupt_signal() == 0 && !atomic_load(&share->has_ended))
        exit(cli_report(error));
    pthread_join(share->thread, NULL);
    if (error->code == FL_ERROR_NONE)
        *error = share->error;
}

static bool show_model(struct command_line *line, struct gateway *gateway, struct fl_error *error)
{
    static struct share share;
    struct cli_sharing *sharing = &share.sharing;
    sharing->job = &line->job;
    sharing->restarts = true;
    sharing->loading.scene_name = line->gateway.seat.scene;
    sharing->loading.daemon_arguments = line->words;
    line->gateway.has_failed = has_ended;
    line->gateway.user = &share;
    if (cli_read_input(&line->job, error) && cli_sharing_begin(sharing, error) &&
        check_scene(&line->gateway.seat, error))
        run_with(gateway, &share, error);
    cli_sharing_end(sharing);
    return error->code == FL_ERROR_NONE;
}

static void serve(struct command_line *line, struct fl_error *error)
{
    struct gateway *gateway = gateway_create(&line->gateway, error);
    if (gateway && line->job.input.model)
        show_model(line, gateway, error);
    else if (gateway && check_scene(&line->gateway.seat, error))
        gateway_run(gateway, error);
    gateway_destroy(gateway);
}

int main(int argc, char **argv)
{
    static struct argp_child children[2];
    children[0].argp = cli_options_argp(CLI_OPTIONS_PAGE);
    static const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "MODEL [--at PLACE] [MODEL [--at PLACE]]... [-- OPTION OF FARLIGHTD...]\n"
                    "--server ADDRESS --scene NAME",
        .doc = "Show a model, or a shared scene of a daemon, in browsers: prints a link, and serves its users "
               "until Ctrl-C.\vThe link has a random token; its users can view the scene, but not change it; "
               "--allow-edit prints another one. Each browser has its own view. Without --server the command "
               "starts a daemon, which ends with it; arguments after -- are the daemon's options.",
        .children = children};
    static struct command_line line;
    struct fl_error error = {0};
    argp_err_exit_status = CLI_USAGE;
    open_standard_descriptors();
    line.gateway.viewers = VIEWERS_DEFAULT;
    web_outage_init(&line.outage);
    if (!cli_job_begin(&line.job, fl_view_defaults()) || cli_parse(&argp, argc, argv, ARGP_IN_ORDER, &line) != 0)
        return cli_report(&line.job.error);
    if (complete(&line, &error) && cli_interrupt_begin(&error))
        serve(&line, &error);
    cli_socket_remove(&line.socket);
    return cli_report(&error);
}
