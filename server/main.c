/* SPDX-License-Identifier: MIT */
/* farlightd: its options, and the role of the process: the front that people start, a worker of it, or a daemon of
 * one client. Exit status: 0 when it was stopped (by SIGTERM or SIGINT, after a goodbye to its clients) or its one
 * client is gone; 1 when it cannot start or continue; 2 for wrong usage; 75 when the GPU of a daemon of one client
 * is lost for good, which may be different in a new process. With --check-device: 0 when all checks pass, 1 when
 * one fails, 75 when the GPU was lost on the way. */
#include "base/allocator.h"
#include "base/clock.h"
#include "base/log.h"
#include "base/timeline.h"
#include "check/check.h"
#include "config.h"
#include "confine.h"
#include "devices.h"
#include "gpu/device.h"
#include "engine/engine.h"
#include "front/front.h"
#include "net/channel.h"
#include "net/notify.h"
#include "session/daemon.h"
#include "session/keeper.h"
#include "protocol/common/standard.h"
#include "protocol/plain_text.h"
#include "protocol/version.h"
#include "store/store.h"

#include <argp.h>
#include <fcntl.h>
#include <inttypes.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sysexits.h>

/* Seconds after which a worker without a client, and without lingering scenes, ends. */
#define WORKER_UNUSED_S 60u
/* Maximum of workers that restore scenes at the start: those of further owners are restored when the owners
 * return. */
#define OWNERS_MAX 64
/* Range of client numbers of each worker. */
#define WORKER_CLIENTS UINT64_C(1000000)

/* Version for argp, which glibc finds by name; -fvisibility=hidden would hide it. */
__attribute__((visibility("default"))) const char *argp_program_version = "farlightd " FARLIGHT_VERSION;

enum {
    KEY_FD = 256,
    KEY_CONFIG,
    KEY_DEVICE,
    KEY_LIST,
    KEY_CHECK,
    KEY_JSON,
    KEY_LEVEL,
    KEY_DUMP,
    KEY_INSECURE,
    KEY_TRACE,
    KEY_KEY,
    KEY_READER_KEY,
    KEY_WORKER
};

static const struct argp_option option_table[] = {
    {"listen", 'l', "ADDRESS", 0, "Listen at unix:/PATH or tcp:HOST:PORT; may be given several times", 0},
    {"fd", KEY_FD, "N", 0,
     "Serve the client at the connected socket N, and exit when it leaves; listen at addresses of --listen only",
     0},
    {"config", KEY_CONFIG, "FILE", 0, "Read options from FILE, after " CONFIG_SYSTEM_FILE, 0},
    {"device", KEY_DEVICE, "N|software|auto", 0, "GPU to use", 0},
    {"list-devices", KEY_LIST, NULL, 0,
     "Print the GPUs that can be used, with the workers that use them, and exit", 0},
    {"check-device", KEY_CHECK, NULL, 0,
     "Check the GPU: limits, memory, programs, every tracer; exit with 0 if all checks pass", 0},
    {"json", KEY_JSON, NULL, 0, "With --check-device: print one JSON object a line", 0},
    {"log-level", KEY_LEVEL, "LEVEL", 0, "error, warning, info or debug", 0},
    {"trace-file", KEY_TRACE, "FILE", 0,
     "Write the stages of all frames to FILE as trace events, for ui.perfetto.dev or chrome://tracing", 0},
    {"key-file", KEY_KEY, "FILE", 0,
     "Accept clients with the key of FILE, on sealed connections from any host ('farlight key' creates a key)", 0},
    {"reader-key-file", KEY_READER_KEY, "FILE", 0, "The same for clients that may view but not edit", 0},
    {"insecure", KEY_INSECURE, NULL, 0, "Accept everybody by TCP, unencrypted, also beyond loopback", 0},
    {"worker", KEY_WORKER, "N", OPTION_HIDDEN, "Be worker N of the front that has started this process", 0},
    {"dump-config", KEY_DUMP, NULL, 0, "Print all options with their values as a configuration file, and exit", 0},
    {0},
};

struct arguments {
    char listen[CONFIG_TEXT_BYTES]; /* addresses, each followed by a blank */
    const char *config_file, *device, *log_level, *insecure, *trace_file, *key_file, *reader_key_file;
    char *worker; /* its number; NULL: no worker */
    int fd;
    bool dump_config, check_device, json;
};

static error_t parse_option(int key, char *value, struct argp_state *state)
{
    struct arguments *arguments = state->input;
    size_t used = strlen(arguments->listen), room = sizeof(arguments->listen) - used;
    switch (key) {
    case 'l':
        if ((size_t)snprintf(arguments->listen + used, room, "%s ", value) >= room)
            argp_error(state, "too many addresses");
        break;
    case KEY_FD:
        arguments->fd = atoi(value);
        if (arguments->fd <= 0)
            argp_error(state, "--fd: \"%s\" is no descriptor", value);
        break;
    case KEY_WORKER:
        arguments->worker = value;
        break;
    case KEY_CONFIG:
        arguments->config_file = value;
        break;
    case KEY_DEVICE:
        arguments->device = value;
        break;
    case KEY_LEVEL:
        arguments->log_level = value;
        break;
    case KEY_TRACE:
        arguments->trace_file = value;
        break;
    case KEY_KEY:
        arguments->key_file = value;
        break;
    case KEY_READER_KEY:
        arguments->reader_key_file = value;
        break;
    case KEY_INSECURE:
        arguments->insecure = "yes";
        break;
    case KEY_LIST:
        exit(devices_print());
    case KEY_CHECK:
        arguments->check_device = true;
        break;
    case KEY_JSON:
        arguments->json = true;
        break;
    case KEY_DUMP:
        arguments->dump_config = true;
        break;
    case ARGP_KEY_END:
        if (arguments->json && !arguments->check_device)
            argp_error(state, "--json goes with --check-device");
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static int fail(const struct error *error)
{
    struct error plain;
    plain_text_copy(plain.field, sizeof(plain.field), error->field);
    plain_text_copy(plain.text, sizeof(plain.text), error->text);
    plain_text_copy(plain.remedy, sizeof(plain.remedy), error->remedy);
    fprintf(stderr, "farlightd: %s%s%s\n", plain.field, plain.field[0] ? ": " : "", plain.text);
    fprintf(stderr, plain.remedy[0] ? "farlightd: %s\n" : "%s", plain.remedy);
    return EXIT_FAILURE;
}

static bool read_config(struct config *config, const struct arguments *arguments, struct error *error)
{
    const char *listen = arguments->listen[0] ? arguments->listen : NULL;
    config_defaults(config);
    return config_read_file(config, CONFIG_SYSTEM_FILE, true, error) &&
           (!arguments->config_file || config_read_file(config, arguments->config_file, false, error)) &&
           config_read_environment(config, error) &&
           config_flag(config, "server.listen", listen, "--listen", error) &&
           config_flag(config, "engine.device", arguments->device, "--device", error) &&
           config_flag(config, "server.insecure", arguments->insecure, "--insecure", error) &&
           config_flag(config, "server.key_file", arguments->key_file, "--key-file", error) &&
           config_flag(config, "server.reader_key_file", arguments->reader_key_file, "--reader-key-file", error) &&
           config_flag(config, "server.trace_file", arguments->trace_file, "--trace-file", error) &&
           config_flag(config, "server.log_level", arguments->log_level, "--log-level", error);
}

static int check(const struct config *config, bool json)
{
    struct engine_options engine;
    struct error error = {0};
    if (!config_engine(config, &engine, &error))
        return fail(&error);
    switch (check_device(&(struct check_options){
        .gpu = engine.gpu, .device_bytes_limit = engine.device_bytes_limit, .stream = stdout, .json = json})) {
    case CHECK_ALL_HOLDS:
        return EXIT_SUCCESS;
    case CHECK_DEVICE_LOST:
        return EX_TEMPFAIL;
    case CHECK_SOME_FAIL:
        break;
    }
    return EXIT_FAILURE;
}

/* ---- a process that serves --------------------------------------------------------------------------- */

/* First packet from the front to a worker, also sent after the configuration was read again. */
struct worker_setup {
    struct config config;         /* without key files, which are the front's alone */
    struct auth_key_numbers keys; /* keys with which clients may have come */
    uint64_t started_ns;          /* start of the front */
    uint64_t watchdog_ns;         /* time without progress after which a device counts as hanging; 0: never */
};

struct serving {
    struct worker_setup setup;
    struct channel_start start;
    uint32_t number; /* number of the worker; 0: no worker */
    char *title;     /* text that lists of processes show after --worker; NULL: no worker */
    struct daemon daemon;
    struct store *store; /* NULL: scenes end with the process */
    struct timeline *timeline;
    bool device_gone;
};

static void fill_hub(const struct worker_setup *setup, struct hub_options *options)
{
    config_hub(&setup->config, options);
    options->keys = setup->keys;
}

/* Seconds until a worker without a client ends; nothing lingers any more by then. */
static uint32_t unused_s(const struct config *config)
{
    return config->scene_linger_s + WORKER_UNUSED_S;
}

static void configured(void *context, const void *bytes, size_t count)
{
    struct serving *serving = context;
    struct hub_options options;
    struct error error = {0};
    if (count != sizeof(serving->setup))
        return;
    memcpy(&serving->setup, bytes, count);
    fill_hub(&serving->setup, &options);
    serving->daemon.unused_s = unused_s(&serving->setup.config);
    if (!hub_reload(&serving->daemon.hub, &options, &error))
        log_write(LOG_ERROR, "config", "the configuration stays as it was: %s", error.text);
    log_set_level((enum log_level)serving->setup.config.log_level);
}

/* Restores scenes kept for the owner, before its first client is served. */
static void owned(void *context, const struct channel_owner *owner)
{
    struct serving *serving = context;
    const struct config *config = &serving->setup.config;
    struct error error = {0};
    if (serving->title)
        devices_set_title(serving->title, serving->number, owner->name, serving->daemon.device);
    if (!config->store[0])
        return;
    serving->store = store_open_owner(config->store, owner->number, config->store_bytes, &error);
    if (serving->store)
        keeper_restore(serving->store, &serving->daemon.hub);
    else
        log_write(LOG_ERROR, "store", "no scene is kept: %s: %s", error.field, error.text);
}

/* Serves; `fd` is the socket of the only client, or of the front. */
static bool serve_with_engine(struct serving *serving, struct engine *engine, int fd, bool is_worker,
                              struct error *error)
{
    struct daemon *daemon = &serving->daemon;
    struct hub_options options;
    fill_hub(&serving->setup, &options);
    options.engine = engine_port(engine);
    options.device_bytes = engine_device_limit_bytes(engine);
    options.timeline = serving->timeline;
    options.owner_may_be_idle = true;
    options.started_ns = serving->setup.started_ns;
    options.first_client = serving->number > 1 ? (serving->number - 1) * WORKER_CLIENTS : 0;
    daemon->device = engine_device(engine)->index;
    daemon->configured = configured;
    daemon->owned = owned;
    daemon->front_context = serving;
    daemon->watchdog_ns = serving->setup.watchdog_ns;
    daemon->unused_s = unused_s(&serving->setup.config);
    bool ok =
        daemon_start(daemon, &options, error) &&
        (is_worker ? daemon_serve_front(daemon, fd, serving->start.has_owner ? &serving->start.owner : NULL, error)
                   : daemon_serve_fd(daemon, fd, error));
    ok = ok && daemon_run(daemon, &serving->device_gone, error);
    daemon_finish(daemon);
    return ok;
}

#define TRACE_PATH_BYTES (CONFIG_TEXT_BYTES + 16)

/* Path of a worker's trace: each writes a file of its own; the first one, and a daemon of one client, use the
 * configured path. */
static void trace_path(char path[TRACE_PATH_BYTES], const struct serving *serving)
{
    const int bytes = snprintf(path, TRACE_PATH_BYTES, "%s", serving->setup.config.trace_file);
    if (bytes && serving->number > 1)
        snprintf(path + bytes, TRACE_PATH_BYTES - (size_t)bytes, ".%" PRIu32, serving->number);
}

/* Enters the sandbox, before the first thread starts. */
static bool begin_confined(struct serving *serving, bool is_worker, struct error *error)
{
    const struct config *config = &serving->setup.config;
    char trace[TRACE_PATH_BYTES], store[PATH_MAX] = "";
    trace_path(trace, serving);
    if (is_worker && config->store[0] &&
        !store_owner_path(store, config->store, serving->start.owner.number, error))
        return false;
    if (!confine(config, trace, store, error))
        return false;
    allocator_start_thread();
    return (!trace[0] || (serving->timeline = timeline_create(trace, config->trace_file_bytes, error)));
}

static bool serve(struct serving *serving, int fd, bool is_worker, struct error *error)
{
    const struct config *config = &serving->setup.config;
    struct engine_options engine_options;
    daemon_init(&serving->daemon);
    if (!config_engine(config, &engine_options, error) || !begin_confined(serving, is_worker, error))
        return false;
    _Static_assert(CHANNEL_DEVICES == GPU_DEVICES_MAX, "the front counts as many devices as EGL may have");
    memcpy(engine_options.gpu.used_by, serving->start.workers_at, sizeof(engine_options.gpu.used_by));
    /* A process that serves a single client drops its scenes with that client. */
    const struct engine_keeper keeper = keeper_port(&serving->store);
    if (is_worker && config->store[0])
        engine_options.keeper = &keeper;
    struct engine *engine = engine_create(&engine_options, error);
    bool ok = engine && serve_with_engine(serving, engine, fd, is_worker, error);
    engine_destroy(engine);
    return ok;
}

static int serve_to_the_end(struct serving *serving, int fd, bool is_worker)
{
    struct error error = {0};
    daemon_block_signals();
    log_set_level((enum log_level)serving->setup.config.log_level);
    bool ok = serve(serving, fd, is_worker, &error);
    store_close(serving->store);
    timeline_destroy(serving->timeline);
    if (ok)
        return serving->device_gone ? EX_TEMPFAIL : EXIT_SUCCESS;
    if (is_worker)
        channel_say(fd, CHANNEL_FAILED, &error, sizeof(error), NULL);
    return is_worker ? EXIT_FAILURE : fail(&error);
}

/* Makes a worker the first to be killed when memory is short: its clients reconnect. */
static void offer_to_end_first(void)
{
    FILE *file = fopen("/proc/self/oom_score_adj", "we");
    if (!file)
        return;
    fprintf(file, "500\n");
    fclose(file);
}

/* Runs as a worker. `title`: the argument of --worker, its number and many blanks. */
static int serve_as_worker(char *title)
{
    const int fd = CHANNEL_WORKER_FD;
    struct serving *serving = calloc(1, sizeof(*serving));
    prctl(PR_SET_PDEATHSIG, SIGKILL); /* the worker ends with the front */
    offer_to_end_first();
    bool ok = serving && fcntl(fd, F_SETFD, FD_CLOEXEC) == 0 &&
              channel_wait(fd, CHANNEL_START, &serving->start, sizeof(serving->start)) &&
              channel_wait(fd, CHANNEL_CONFIG, &serving->setup, sizeof(serving->setup));
    if (ok) {
        serving->number = (uint32_t)atoi(title);
        serving->title = title;
    }
    int status = ok ? serve_to_the_end(serving, fd, true) : EXIT_FAILURE;
    free(serving);
    return status;
}

static int serve_one_client(const struct config *config, int fd)
{
    struct serving *serving = calloc(1, sizeof(*serving));
    int status = EXIT_FAILURE;
    if (serving) {
        serving->setup.config = *config;
        serving->setup.started_ns = clock_now_ns();
        status = serve_to_the_end(serving, fd, false);
    }
    free(serving);
    return status;
}

/* ---- the front --------------------------------------------------------------------------------------- */

/* Source of the configuration, for reading it again. */
struct source {
    const struct arguments *arguments;
    struct config *config;
    struct worker_setup *setup;
    struct front *front;
    struct store_folder *folder; /* NULL: scenes end with the daemon */
};

/* Fills the front's options. False: the configuration is invalid. The caller has a reference to options->keys
 * in any case. */
static bool fill_front(struct source *source, const struct config *config, struct front_options *options,
                       struct error *error)
{
    struct engine_options engine;
    if (!config_front(config, options, error) || !config_engine(config, &engine, error))
        return false;
    source->setup->config = *config;
    source->setup->config.key_file[0] = source->setup->config.reader_key_file[0] = '\0';
    source->setup->keys = auth_keys_numbers(options->keys);
    options->setup = source->setup;
    options->setup_bytes = sizeof(*source->setup);
    return true;
}

/* Reads the configuration again, and applies either all of it or nothing. */
static void reload(void *context)
{
    struct source *source = context;
    struct config next;
    struct front_options options = {0};
    struct error error = {0};
    bool read = read_config(&next, source->arguments, &error);
    if (read)
        config_keep_start(&next, source->config);
    if (!read || !fill_front(source, &next, &options, &error) || !front_reload(source->front, &options, &error)) {
        log_write(LOG_ERROR, "config", "the configuration stays as it was: %s%s%s", error.field,
                  error.field[0] ? ": " : "", error.text);
        auth_keys_unref(options.keys);
        return;
    }
    auth_keys_unref(options.keys); /* the front has its own reference */
    *source->config = next;
    log_set_level((enum log_level)source->config->log_level);
}

/* Begins to listen; sockets from a service manager replace the configured addresses. */
static bool begin_to_listen(struct front *front, const struct config *config, bool beyond_loopback,
                            struct error *error)
{
    size_t activated;
    return front_listen_activated(front, beyond_loopback, &activated, error) &&
           (activated || front_listen(front, config->listen, beyond_loopback, error));
}

static bool run_front(struct source *source, struct front *front, struct error *error)
{
    struct front_options options = {0};
    uint64_t owners[OWNERS_MAX];
    source->setup->started_ns = clock_now_ns();
    source->setup->watchdog_ns = notify_watchdog_ns();
    const bool filled = fill_front(source, source->config, &options, error);
    options.owner_fd = source->arguments->fd;
    options.owners = owners;
    options.owners_first = source->folder != NULL;
    options.owner_count = source->folder ? store_owners(source->folder, owners, OWNERS_MAX) : 0;
    front->reload = reload;
    front->reload_context = source;
    bool ok = filled && begin_to_listen(front, source->config, source->config->insecure || options.keys, error) &&
              front_run(front, &options, stdout, error);
    front_finish(front);
    auth_keys_unref(options.keys);
    return ok;
}

static int be_front(const struct arguments *arguments, struct config *config)
{
    struct worker_setup *setup = calloc(1, sizeof(*setup));
    struct front front;
    struct error error = {0};
    front_init(&front);
    struct source source = {.arguments = arguments, .config = config, .setup = setup, .front = &front};
    bool ok = setup || error_set(&error, ERROR_OUT_OF_MEMORY, NULL, "no memory");
    if (ok && config->store[0])
        ok = (source.folder = store_claim(config->store, &error)) != NULL;
    ok = ok && run_front(&source, &front, &error);
    store_release(source.folder);
    free(setup);
    return ok ? EXIT_SUCCESS : fail(&error);
}

int main(int argc, char **argv)
{
    static const struct argp argp = {option_table, parse_option, NULL, "The farlight rendering daemon.", 0, 0, 0};
    struct arguments arguments = {.fd = -1};
    struct config config;
    struct error error = {0};
    argp_err_exit_status = 2;
    open_standard_descriptors();
    argp_parse(&argp, argc, argv, 0, NULL, &arguments);
    if (arguments.worker)
        return serve_as_worker(arguments.worker);
    if (!read_config(&config, &arguments, &error))
        return fail(&error);
    if (arguments.dump_config)
        return !config_dump(&config, stdout);
    log_set_level((enum log_level)config.log_level);
    if (arguments.check_device)
        return check(&config, arguments.json);
    const bool listens = arguments.fd < 0 || arguments.listen[0];
    return listens ? be_front(&arguments, &config) : serve_one_client(&config, arguments.fd);
}
