/* SPDX-License-Identifier: MIT */
/* farlight serve: shares a scene, on a private daemon, which listens on the given addresses and ends with the
 * command, or on a running one. */
#include "options/sharing.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "protocol/plain_text.h"
#include "commands.h"
#include "options/arguments.h"
#include "options/image_path.h"
#include "options/interrupt.h"
#include "options/job.h"
#include "options/loading.h"
#include "options/models.h"
#include "options/parse.h"
#include "options/talk.h"

#define KEY_LISTEN 0x400
#define KEY_NAME 0x401
#define KEY_ENVIRONMENT 0x402
#define KEY_ENVIRONMENT_ROTATION 0x404
#define KEY_KEY 0x403
#define KEY_VARIANT 0x405
#define KEY_AT 0x406
#define KEY_WATCH 0x407

#define LISTENS_MAX 8
#define DAEMON_WORDS_MAX 28 /* limit of fl_connect */

struct serving {
    struct cli_job job; /* model, environment, server, key file; and an option's error */
    const char *name;
    const char *listens[LISTENS_MAX];
    size_t listen_count;
    const char *words[DAEMON_WORDS_MAX + 1]; /* the daemon's arguments, and a NULL */
    size_t word_count;
    struct cli_socket socket; /* used if no address is given */
};

static const struct argp_option options[] = {
    {"listen", KEY_LISTEN, "ADDRESS", 0,
     "Let the daemon listen at unix:/PATH or tcp:HOST:PORT; may be repeated (default: a socket in "
     "$XDG_RUNTIME_DIR, or without that in a new folder in /tmp)",
     0},
    {"server", 's', "ADDRESS", 0,
     "Share the scene on this running daemon: unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET]", 0},
    {"key", KEY_KEY, "FILE", 0,
     "Use this key for TCP beyond this host ('farlight key' creates one), for the new daemon or for --server", 0},
    {"name", KEY_NAME, "NAME", 0, "Set the scene's name for other clients (default: the model's file name)", 0},
    {"environment", KEY_ENVIRONMENT, "FILE", 0, "Light the scene with this equirectangular image (HDR or EXR)", 0},
    {"environment-rotation", KEY_ENVIRONMENT_ROTATION, "DEGREES", 0,
     "Turn the environment about +y by -360 to 360 (default 0: its middle column is +x)", 0},
    {"at", KEY_AT, "X,Y,Z[:RX,RY,RZ[:SCALE]]", 0,
     "Place the MODEL named before: metres, degrees about x, then y, then z, and a factor; repeat it for a copy",
     0},
    {"variant", KEY_VARIANT, "NAME", 0, "Show the materials of this variant of a glTF model", 0},
    {"watch", KEY_WATCH, NULL, 0, "Load the model again when it, or a file that it names, has changed", 0},
    {"quiet", 'q', NULL, 0, "Print no progress and no notes about the model", 0},
    {0}};

static error_t add_word(struct serving *serving, const char *word)
{
    if (serving->word_count == DAEMON_WORDS_MAX)
        return cli_usage(&serving->job, word, "too many options for the daemon");
    serving->words[serving->word_count++] = word;
    return 0;
}

/* Processes arguments in order, so that those after -- are distinguished from those before it. */
static error_t take_argument(struct serving *serving, char *value, const struct argp_state *state)
{
    if (state->quoted > 0 && state->next > state->quoted)
        return add_word(serving, value);
    return cli_set_model(&serving->job, value);
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct serving *serving = state->input;
    struct cli_job *job = &serving->job;
    switch (key) {
    case KEY_LISTEN:
        if (serving->listen_count == LISTENS_MAX)
            return cli_usage(job, "--listen", "at most %d addresses can be given", LISTENS_MAX);
        serving->listens[serving->listen_count++] = value;
        return 0;
    case 's':
        job->daemon.server = value;
        return 0;
    case KEY_KEY:
        job->daemon.key_file = value;
        return 0;
    case KEY_NAME:
        serving->name = value;
        return 0;
    case KEY_ENVIRONMENT:
        job->input.environment = value;
        return 0;
    case KEY_ENVIRONMENT_ROTATION:
        return cli_set_environment_rotation(job, "--environment-rotation", value);
    case KEY_AT:
        return cli_set_place(job, "--at", value);
    case KEY_VARIANT:
        job->input.variant = value;
        return 0;
    case KEY_WATCH:
        job->input.watch = true;
        return 0;
    case 'q':
        job->talk.quiet = true;
        return 0;
    case ARGP_KEY_ARG:
        return take_argument(serving, value, state);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* ---- the daemon's command line ---- */

static const char *usual_address(struct serving *serving)
{
    struct fl_error *error = &serving->job.error;
    if (cli_socket_choose(&serving->socket, error))
        return serving->socket.address;
    snprintf(error->field, sizeof(error->field), "--listen");
    return NULL;
}

/* Builds the daemon's arguments. The user's own come last, because the later of two options counts. */
static bool complete_daemon(struct serving *serving)
{
    const char *typed[DAEMON_WORDS_MAX];
    const size_t typed_count = serving->word_count;
    error_t status = 0;
    memcpy(typed, serving->words, typed_count * sizeof(*typed));
    serving->word_count = 0;
    if (serving->listen_count == 0 && !(serving->listens[serving->listen_count++] = usual_address(serving)))
        return false;
    for (size_t i = 0; i < serving->listen_count && status == 0; i++)
        status = add_word(serving, "--listen") != 0 ? EINVAL : add_word(serving, serving->listens[i]);
    if (serving->job.daemon.key_file && status == 0)
        status = add_word(serving, "--key-file") != 0 ? EINVAL : add_word(serving, serving->job.daemon.key_file);
    /* The daemon's output goes to this process; its last line is shown if it fails. */
    if (status == 0)
        status = add_word(serving, "--log-level") != 0 ? EINVAL : add_word(serving, "error");
    for (size_t i = 0; i < typed_count && status == 0; i++)
        status = add_word(serving, typed[i]);
    return status == 0;
}

static bool complete(struct serving *serving)
{
    struct cli_job *job = &serving->job;
    if (!job->input.model)
        return cli_usage(job, "MODEL", "a model file is needed") == 0;
    if (!cli_check_watch(job))
        return false;
    if (serving->name && serving->name[0] == '\0')
        return cli_usage(job, "--name", "the name is empty, but other clients need it to attach") == 0;
    if (!job->daemon.server)
        return complete_daemon(serving);
    if (serving->listen_count > 0)
        return cli_usage(job, "--listen",
                         "the daemon at --server already has its addresses; leave --listen out") == 0;
    if (serving->word_count > 0)
        return cli_usage(job, serving->words[0],
                         "the daemon at --server already has its options; leave this out") == 0;
    return true;
}

/* ---- messages to users ---- */

/* Prints a word in the shell's syntax. */
static void print_word(const char *word)
{
    const char *harmless = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789/._-+@%,=:[]";
    if (word[0] != '\0' && word[strspn(word, harmless)] == '\0') {
        fputs(word, stdout);
        return;
    }
    putchar('\'');
    for (char shown[UTF8_BYTES_MAX]; *word != '\0';) {
        const size_t bytes = plain_text_next(&word, shown);
        if (shown[0] == '\'')
            fputs("'\\''", stdout);
        else
            fwrite(shown, 1, bytes, stdout);
    }
    putchar('\'');
}

/* Prints an address. For a daemon that listens on all addresses, other hosts need this host's name. */
static void print_address(const char *address)
{
    static const char *const all[] = {"tcp:0.0.0.0:", "tcp:[::]:"};
    char host[256] = "";
    for (size_t i = 0; i < sizeof(all) / sizeof(all[0]); i++) {
        const size_t bytes = strlen(all[i]);
        if (strncmp(address, all[i], bytes) != 0 || gethostname(host, sizeof(host) - 1) != 0)
            continue;
        printf("tcp:%s:%s", host, address + bytes);
        return;
    }
    print_word(address);
}

static void print_line(const struct serving *serving, const char *name, const char *address)
{
    fputs("  farlight view --scene ", stdout);
    print_word(name);
    fputs(" --server ", stdout);
    print_address(address);
    if (serving->job.daemon.key_file && strncmp(address, "tcp:", 4) == 0) {
        fputs(" --key ", stdout);
        print_word(serving->job.daemon.key_file);
    }
    putchar('\n');
}

static bool announce(const struct serving *serving, const struct cli_loading *loading, struct fl_error *error)
{
    const char *name = loading->scene_name;
    struct fl_scene_bounds bounds;
    char address[300];
    if (!fl_scene_get_bounds(loading->scene, &bounds, error))
        return false;
    fputs("serving \"", stdout);
    cli_print_name(name);
    printf("\", %llu triangles and %llu spheres; view it with\n", (unsigned long long)bounds.triangles,
           (unsigned long long)bounds.spheres);
    if (serving->job.daemon.server)
        print_line(serving, name, serving->job.daemon.server);
    for (size_t i = 0; fl_connection_listens_at(loading->connection, i, address, sizeof(address)); i++)
        print_line(serving, name, address);
    if (fflush(stdout) != 0)
        return fl_error_set(error, FL_ERROR_FILE, "standard output", "cannot be written: %s", strerror(errno));
    return true;
}

static int serve(struct serving *serving)
{
    struct fl_error error = {0};
    if (!complete(serving))
        return cli_report(&serving->job.error);
    if (!cli_interrupt_begin(&error))
        return cli_report(&error);
    struct cli_sharing sharing = {
        .job = &serving->job,
        .loading = {.scene_name = serving->name ? serving->name : cli_base_name(serving->job.input.model),
                    .daemon_arguments = serving->words}};
    const bool done = cli_read_input(&serving->job, &error) && cli_sharing_begin(&sharing, &error) &&
                      announce(serving, &sharing.loading, &error) && cli_sharing_stay(&sharing, &error);
    cli_sharing_end(&sharing);
    return done ? CLI_DONE : cli_report(&error);
}

int cli_serve(int argc, char **argv)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "MODEL... [-- OPTION OF FARLIGHTD...]",
        .doc = "Share a model for other clients to view, render and edit, until Ctrl-C.\v"
               "Without --server the command starts a daemon, which ends with the command. Arguments after -- are "
               "options of that daemon, for example --device software."};
    struct serving serving = {0};
    if (cli_parse(&argp, argc, argv, ARGP_IN_ORDER, &serving) != 0)
        return cli_report(&serving.job.error);
    const int status = serve(&serving);
    cli_socket_remove(&serving.socket);
    return status;
}
