/* SPDX-License-Identifier: MIT */
/* farlightd: options, and the wiring of the engine to the network.
 * Exit status: 0 when it was stopped (by SIGTERM or SIGINT, after a goodbye to its clients) or its one client is
 * gone; 1 when it cannot start or go on; 2 for wrong usage; 75 when its GPU is lost for good, which may be
 * different in a new process. With --check-device: 0 when all holds, 1 when something does not, 75 when the GPU
 * was lost on the way. */
#include "base/log.h"
#include "base/timeline.h"
#include "check/check.h"
#include "config.h"
#include "gpu/device.h"
#include "engine/engine.h"
#include "session/daemon.h"
#include "session/keeper.h"
#include "protocol/common/standard.h"
#include "protocol/plain_text.h"
#include "protocol/version.h"
#include "store/store.h"

#include <argp.h>
#include <stdlib.h>
#include <string.h>
#include <sysexits.h>

/* glibc looks for it by name, which -fvisibility=hidden would hide. */
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
    KEY_READER_KEY
};

static const struct argp_option option_table[] = {
    {"listen", 'l', "ADDRESS", 0, "Listen at unix:/PATH or tcp:HOST:PORT; may be given several times", 0},
    {"fd", KEY_FD, "N", 0,
     "Serve the client at the connected socket N, and exit with it; listen only where --listen says so", 0},
    {"config", KEY_CONFIG, "FILE", 0, "Read options from FILE, after " CONFIG_SYSTEM_FILE, 0},
    {"device", KEY_DEVICE, "N|software|auto", 0, "GPU to use", 0},
    {"list-devices", KEY_LIST, NULL, 0, "Print the GPUs that can be used, and exit", 0},
    {"check-device", KEY_CHECK, NULL, 0,
     "Look the GPU over: limits, memory, programs, every tracer; exit with 0 if all of it holds", 0},
    {"json", KEY_JSON, NULL, 0, "With --check-device: print one JSON object a line", 0},
    {"log-level", KEY_LEVEL, "LEVEL", 0, "error, warning, info or debug", 0},
    {"trace-file", KEY_TRACE, "FILE", 0,
     "Write the stages of all frames to FILE as trace events, for ui.perfetto.dev or chrome://tracing", 0},
    {"key-file", KEY_KEY, "FILE", 0,
     "Let clients with the key of FILE come in from everywhere, on sealed connections ('farlight key' makes one)",
     0},
    {"reader-key-file", KEY_READER_KEY, "FILE", 0, "The same for clients who may look, but change nothing", 0},
    {"insecure", KEY_INSECURE, NULL, 0, "Let TCP be open to everybody and unencrypted, also beyond loopback", 0},
    {"dump-config", KEY_DUMP, NULL, 0, "Print all options with their values as a configuration file, and exit", 0},
    {0},
};

struct arguments {
    char listen[CONFIG_TEXT_BYTES]; /* all of them, each followed by a blank */
    const char *config_file, *device, *log_level, *insecure, *trace_file, *key_file, *reader_key_file;
    int fd;
    bool dump_config, check_device, json;
};

static int list_devices(void)
{
    struct gpu_device_info list[32];
    size_t count = gpu_device_list(list, sizeof(list) / sizeof(list[0]));
    for (size_t i = 0; i < count; i++) {
        struct gpu_measured measured;
        printf("%d  %s  (%s, OpenGL %s%s)\n", list[i].index, list[i].name, list[i].vendor, list[i].version,
               list[i].software ? ", software" : "");
        if (gpu_measured_load(&list[i], &measured))
            printf("   first hits are traced from %.3g primitives a pixel on, from %.3g with several samples\n",
                   (double)measured.traced_from[0], (double)measured.traced_from[1]);
        else
            printf("   first hits are rasterised, until the first start measures\n");
    }
    return count ? EXIT_SUCCESS : (fprintf(stderr, "farlightd: no device gives OpenGL 4.5\n"), EXIT_FAILURE);
}

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
        exit(list_devices());
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

/* How the configuration came about, to be read again. */
struct source {
    const struct arguments *arguments;
    struct config *config;
    struct daemon *daemon;
};

/* All of it or, where something is wrong, nothing. */
static void reload(void *context)
{
    struct source *source = context;
    struct config next;
    struct hub_options options = {0};
    struct error error = {0};
    bool read = read_config(&next, source->arguments, &error);
    if (read)
        config_keep_start(&next, source->config);
    if (!read || !config_hub(&next, &options, &error) || !hub_reload(&source->daemon->hub, &options, &error)) {
        log_write(LOG_ERROR, "config", "the configuration stays as it was: %s%s%s", error.field,
                  error.field[0] ? ": " : "", error.text);
        auth_keys_unref(options.keys);
        return;
    }
    auth_keys_unref(options.keys); /* the hub has its own reference */
    *source->config = next;
    log_set_level((enum log_level)source->config->log_level);
    log_write(LOG_INFO, "config", "the configuration was read again");
}

/* Whoever starts us with sockets knows where they are to be. */
static bool begin_to_listen(struct daemon *daemon, const struct config *config, bool beyond_loopback,
                            struct error *error)
{
    size_t activated;
    return daemon_listen_activated(daemon, beyond_loopback, &activated, error) &&
           (activated || daemon_listen(daemon, config->listen, beyond_loopback, error));
}

struct serving {
    struct daemon *daemon;
    const struct config *config;
    int fd; /* of the client; < 0: there is none yet */
    bool listens;
    struct timeline *timeline;
    struct store *store; /* NULL: scenes end with the daemon */
    bool device_gone;
};

static bool serve_with_engine(struct serving *serving, struct hub_options *options, struct engine *engine,
                              struct error *error)
{
    struct daemon *daemon = serving->daemon;
    options->engine = engine_port(engine);
    options->device_bytes = engine_device_limit_bytes(engine);
    options->timeline = serving->timeline;
    options->owner_may_be_idle = true;
    daemon->unused_ns = serving->config->unused_s * UINT64_C(1000000000);
    bool ok = daemon_start(daemon, options, error);
    auth_keys_unref(options->keys); /* the hub has its own reference */
    if (ok && serving->store)
        keeper_restore(serving->store, &daemon->hub);
    ok = ok && (serving->fd < 0 || daemon_serve_fd(daemon, serving->fd, error));
    if (ok) {
        daemon_print_ready(daemon, stdout);
        ok = daemon_run(daemon, &serving->device_gone, error);
    }
    daemon_finish(daemon);
    return ok;
}

static bool serve(struct serving *serving, struct error *error)
{
    const struct config *config = serving->config;
    struct engine_options engine_options;
    struct hub_options options;
    if (!config_engine(config, &engine_options, error) || !config_hub(config, &options, error) ||
        (serving->listens && !begin_to_listen(serving->daemon, config, config->insecure || options.keys, error)))
        return false;
    /* Scenes of a daemon that serves one client alone end with that client. */
    if (serving->listens && config->store[0] &&
        !(serving->store = store_open(config->store, config->store_bytes, error)))
        return false;
    const struct engine_keeper keeper = keeper_port(serving->store);
    if (serving->store)
        engine_options.keeper = &keeper;
    struct engine *engine = engine_create(&engine_options, error);
    bool ok = engine && serve_with_engine(serving, &options, engine, error);
    engine_destroy(engine);
    store_close(serving->store);
    return ok;
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
    if (!read_config(&config, &arguments, &error))
        return fail(&error);
    if (arguments.dump_config)
        return !config_dump(&config, stdout);
    log_set_level((enum log_level)config.log_level);
    if (arguments.check_device)
        return check(&config, arguments.json);
    daemon_block_signals();
    bool listens = arguments.fd < 0 || arguments.listen[0];
    struct daemon daemon;
    daemon_init(&daemon);
    struct source source = {.arguments = &arguments, .config = &config, .daemon = &daemon};
    daemon.reload = reload;
    daemon.reload_context = &source;
    struct timeline *timeline = NULL;
    if (config.trace_file[0])
        timeline = timeline_create(config.trace_file, config.trace_file_bytes, &error);
    struct serving serving = {
        .daemon = &daemon, .config = &config, .fd = arguments.fd, .listens = listens, .timeline = timeline};
    bool ok = (timeline || !config.trace_file[0]) && serve(&serving, &error);
    daemon_finish(&daemon); /* what was begun before it failed */
    timeline_destroy(timeline);
    return !ok ? fail(&error) : serving.device_gone ? EX_TEMPFAIL : EXIT_SUCCESS;
}
