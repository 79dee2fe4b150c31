/* SPDX-License-Identifier: MIT */
#include "config.h"

#include "base/host.h"
#include "base/log.h"
#include "protocol/version.h"

#include <ctype.h>
#include <errno.h>
#include <ini.h>
#include <inttypes.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define SOCKET_NAME "farlight.sock"

#define KIB UINT64_C(1024)
#define MIB (1024 * KIB)
#define GIB (1024 * MIB)
#define TIB (1024 * GIB)

#define COMMENT_COLUMNS 100
#define COMMENT_MAX_BYTES 1024

enum option_type { OPTION_TEXT, OPTION_BOOL, OPTION_LEVEL, OPTION_U32, OPTION_BYTES, OPTION_MEBIBYTES };

/* Time at which a value is read: at the start, or also when the daemon reads its configuration again. */
enum option_time { START, ANYTIME };

struct option {
    const char *section, *key;
    enum option_time time;
    enum option_type type;
    size_t offset;
    const char *default_text;
    uint64_t min, max;
    const char *unit; /* "" for plain numbers */
    const char *doc;
};

#define AT(member) offsetof(struct config, member)

/* clang-format off */
static const struct option options[] = {
    {"server", "listen", START, OPTION_TEXT, AT(listen), "unix:" HOST_RUNTIME_FOLDER "/" SOCKET_NAME, 0, 0, "",
     "Addresses to listen at, separated by blanks: unix:/PATH, tcp:HOST:PORT. A path may have blanks"},
    {"server", "readers", ANYTIME, OPTION_TEXT, AT(readers), "", 0, 0, "",
     "Read-only users of the Unix socket: names or numbers, separated by blanks. They attach to shared scenes and "
     "render them, but change nothing. This does not apply to TCP on loopback, where users are not identified: a key "
     "closes it"},
    {"server", "weights", ANYTIME, OPTION_TEXT, AT(weights), "", 0, 0, "",
     "Shares of processor time: NAME=WEIGHT with weights of 1 to 10000, separated by blanks. A name is that of a user, "
     "its number, keys for those who come by a key, or networks for clients that nobody knows; the others have 100. It "
     "counts from the next start of the user's process"},
    {"server", "insecure", START, OPTION_BOOL, AT(insecure), "no", 0, 1, "",
     "Let TCP clients connect without a key, from beyond loopback too: nothing is encrypted, no client is authenticated"},
    {"server", "key_file", ANYTIME, OPTION_TEXT, AT(key_file), "", 0, 0, "",
     "File of a key, created by 'farlight key': clients with the key may connect from everywhere, over a sealed link, "
     "and TCP needs it, on loopback too"},
    {"server", "reader_key_file", ANYTIME, OPTION_TEXT, AT(reader_key_file), "", 0, 0, "",
     "The same for read-only clients"},
    {"server", "sandbox", START, OPTION_BOOL, AT(sandbox), "yes", 0, 1, "",
     "Confine the processes that serve: no network but their clients, no other programs, no files but those of the "
     "system, of drivers, of caches and of scenes.store. no: for a driver that needs more"},
    {"server", "log_level", ANYTIME, OPTION_LEVEL, AT(log_level), "info", 0, 0, "", "error, warning, info or debug"},
    {"server", "trace_file", START, OPTION_TEXT, AT(trace_file), "", 0, 0, "",
     "File that gets the stages of all frames as trace events, for ui.perfetto.dev or chrome://tracing"},
    {"server", "unused", START, OPTION_U32, AT(unused_s), "0", 0, 31536000, "s",
     "Time without any client after which the daemon ends; 0: it stays. Where systemd holds its socket, the next "
     "client starts it again"},

    {"engine", "device", START, OPTION_TEXT, AT(device), "auto", 0, 0, "",
     "GPU: a number of --list-devices, software, or auto for the first hardware, else software"},
    {"engine", "encode_threads", START, OPTION_U32, AT(encode_threads), "0", 0, 64, "",
     "Threads that encode frames, of which one client has all but one at most; 0: one per core, 2 to 4"},

    {"memory", "scene", ANYTIME, OPTION_BYTES, AT(scene_bytes), "10%", MIB, 16 * TIB, "bytes",
     "Host memory of one scene, and of all of a user together without their blobs. A percentage is of what the daemon may have: of "
     "the host's memory, or of the limit of its control group (cgroup) if that is lower"},
    {"memory", "blobs", ANYTIME, OPTION_BYTES, AT(limits.blob_bytes), "20%", MIB, 16 * TIB, "bytes",
     "Host memory of all blobs of a user together: vertices, texels and the like"},
    {"memory", "blob_cache", ANYTIME, OPTION_BYTES, AT(limits.blob_cache_bytes), "10%", 0, 16 * TIB, "bytes",
     "The part of it for blobs that are no longer used, kept for a user's next connection"},
    {"memory", "transactions", ANYTIME, OPTION_BYTES, AT(limits.transaction_bytes), "5%", MIB, 16 * TIB, "bytes",
     "Host memory of the edits of all clients of a user that wait to be committed"},
    {"memory", "frames", ANYTIME, OPTION_BYTES, AT(limits.frame_bytes), "15%", MIB, 16 * TIB, "bytes",
     "Host memory of the frames of all jobs of a user; a job that may need more waits for others to end"},
    {"memory", "device", START, OPTION_BYTES, AT(device_bytes), "0", 0, 16 * TIB, "bytes",
     "Device memory of a user; 0: 70 % of the device's own, 85 % of what is free where the driver tells no more, 2 GiB (at most 25 % "
     "of what the daemon may have of the host's) where it tells nothing. Software GL has 25 % of the latter"},
    {"memory", "programs", START, OPTION_BYTES, AT(program_bytes), "256M", 0, 16 * TIB, "bytes",
     "Size of the compiled programs that are kept on the disk, in the folder farlight of $XDG_CACHE_HOME or ~/.cache; "
     "beyond it, those that were used longest ago are removed. 0: no limit"},
#define MEMORY_LIMIT(tracer, doc)                                                                                 \
    {"memory", #tracer, ANYTIME, OPTION_MEBIBYTES, AT(limits.tracers.tracer##_mebibytes), "0", 0, 16 * TIB, "bytes", \
     "The part of the device memory for " doc ". 0: no limit of its own"},
#include "protocol/tracers.def"

    {"scenes", "store", START, OPTION_TEXT, AT(store), "", 0, 0, "",
     "Folder in which kept and shared scenes outlive the daemon, such as /var/lib/farlight/scenes; empty: they end "
     "with it. A scene is written about a second after it has changed, and removed when it ends. The folder belongs to "
     "one daemon, and nobody but its user may enter: what users have uploaded is in it, not encrypted"},
    {"scenes", "store_bytes", START, OPTION_BYTES, AT(store_bytes), "16G", MIB, 1024 * TIB, "bytes",
     "Maximum size of what a user has in the folder; beyond it, the scene goes that was written first"},

    {"limits", "clients", ANYTIME, OPTION_U32, AT(limits.clients), "256", 1, 65536, "", "Connected clients"},
    {"limits", "share", ANYTIME, OPTION_U32, AT(limits.share_percent), "75", 1, 100, "%",
     "What one user or key may have of limits.clients; the rest is kept for others. The daemon's own user and root "
     "always find a place"},
    {"limits", "unauthenticated", ANYTIME, OPTION_U32, AT(limits.unauthenticated), "64", 2, 65536, "",
     "Connections whose handshake is not complete. Beyond half of them, a newcomer takes the place of one of the user "
     "or network that has most, chosen at random"},
    {"limits", "unauthenticated_per_address", ANYTIME, OPTION_U32, AT(limits.unauthenticated_per_address), "8", 1, 65536, "",
     "The same, from one TCP address; a newcomer takes the place of another one, chosen at random"},
    {"limits", "handshakes", ANYTIME, OPTION_U32, AT(limits.handshakes_a_second), "500", 1, 1000000, "",
     "Sealed handshakes from one TCP address, or IPv6 network of 64 bits, within a second. Further ones wait for their "
     "turn, whatever their key"},
    {"limits", "requests", ANYTIME, OPTION_U32, AT(limits.requests_in_flight), "64", 1, 65536, "",
     "Requests of one client in flight"},
    {"limits", "scenes", ANYTIME, OPTION_U32, AT(limits.scenes_per_client), "8", 1, 65536, "", "Open scenes of one client"},
    {"limits", "scene_linger", ANYTIME, OPTION_U32, AT(scene_linger_s), "120", 0, 86400, "s",
     "How long a kept or shared scene lingers after its last client has left; 0: not at all"},
    {"limits", "scenes_lingering", ANYTIME, OPTION_U32, AT(lingering_scenes), "16", 1, 65536, "",
     "Lingering scenes of one user or key; beyond it, the oldest one ends. They are evicted when memory is full"},
    {"limits", "jobs", ANYTIME, OPTION_U32, AT(limits.jobs_per_client), "4", 1, 65536, "", "Running jobs of one client"},
    {"limits", "blobs", ANYTIME, OPTION_U32, AT(limits.blobs_per_client), "262144", 1, 16777216, "",
     "Blobs that one connection may name"},
    {"limits", "transaction_edits", ANYTIME, OPTION_U32, AT(limits.transaction_edits), "1048576", 1, 16777216, "",
     "Edits of one client that wait to be committed"},
    {"limits", "nodes", ANYTIME, OPTION_U32, AT(limits.nodes), "4194304", 1, 16777216, "", "Nodes of one scene"},
    {"limits", "depth", ANYTIME, OPTION_U32, AT(limits.depth), "256", 1, SCENE_DEPTH_MAX, "",
     "Levels of a scene's node hierarchy"},
    {"limits", "texture_edge", ANYTIME, OPTION_U32, AT(limits.texture_edge_texels), "16384", 1, 16384, "texels",
     "Width and height of a texture"},
    {"limits", "width", ANYTIME, OPTION_U32, AT(limits.width_pixels), "8192", 1, 8192, "pixels", "Width of a frame"},
    {"limits", "height", ANYTIME, OPTION_U32, AT(limits.height_pixels), "8192", 1, 8192, "pixels", "Height of a frame"},
    {"limits", "samples", ANYTIME, OPTION_U32, AT(limits.samples), "65536", 1, 65536, "", "Samples per pixel"},
#define TRACER_LIMIT(tracer, field, min, max, doc)                                                                \
    {"limits", #tracer "_" #field, ANYTIME, OPTION_U32, AT(limits.tracers.tracer##_##field), #max, min, max, "", doc},
#include "protocol/tracers.def"
    {"limits", "upload_window", ANYTIME, OPTION_BYTES, AT(limits.upload_window_bytes), "16M", MIB, GIB, "bytes",
     "Blob data that a client may send ahead"},
    {"limits", "frame_window", ANYTIME, OPTION_BYTES, AT(limits.frame_window_bytes), "64M", MIB, 16 * GIB, "bytes",
     "Rendered frames of one job that may wait to be sent, if that is more than one"},
    {"limits", "trace_file", START, OPTION_BYTES, AT(trace_file_bytes), "256M", KIB, TIB, "bytes",
     "Maximum size of the trace file"},

    {"network", "handshake", ANYTIME, OPTION_U32, AT(connection.handshake_ms), "5000", 10, 600000, "ms",
     "Time for a client's handshake"},
    {"network", "wrong_key", ANYTIME, OPTION_U32, AT(connection.wrong_key_ms), "1000", 0, 60000, "ms",
     "Delay before a wrong key is answered"},
    {"network", "progress_grace", ANYTIME, OPTION_U32, AT(connection.progress_grace_ms), "5000", 10, 600000, "ms",
     "Time in which any message may arrive, whatever its size"},
    {"network", "progress", ANYTIME, OPTION_U32, AT(connection.progress_bytes_per_s), "1024", 1, 1048576, "bytes/s",
     "Minimum rate of a message that takes longer"},
    {"network", "idle", ANYTIME, OPTION_U32, AT(connection.idle_ms), "120000", 0, 86400000, "ms",
     "Silence after which a client that waits for nothing is disconnected; 0: never"},
    {"network", "lost_after", ANYTIME, OPTION_U32, AT(connection.lost_ms), "600000", 0, 86400000, "ms",
     "Silence after which a client that waits for a frame or an answer is disconnected, though it is pinged twice in that "
     "time; 0: never"},
    {"network", "queued_soft", ANYTIME, OPTION_BYTES, AT(connection.queued_soft_bytes), "16M", MIB, 16 * GIB, "bytes",
     "Output waiting for a client beyond which nothing more is read from it, .."},
    {"network", "queued_soft_time", ANYTIME, OPTION_U32, AT(connection.queued_soft_ms), "10000", 10, 600000, "ms",
     ".. and the time after which it is disconnected"},
    {"network", "queued_hard", ANYTIME, OPTION_BYTES, AT(connection.queued_hard_bytes), "64M", MIB, 16 * GIB, "bytes",
     "Output waiting for a client beyond which it is disconnected at once"},
};
/* clang-format on */
#define OPTION_COUNT (sizeof(options) / sizeof(options[0]))

/* ---- values ------------------------------------------------------------------------------------------ */

static bool parse_level(const char *text, uint32_t *level)
{
    for (uint32_t i = 0; i < LOG_LEVEL_COUNT; i++) {
        if (strcmp(text, log_level_name((enum log_level)i)) == 0) {
            *level = i;
            return true;
        }
    }
    return false;
}

static bool parse_bool(const char *text, bool *value)
{
    *value = strcmp(text, "yes") == 0 || strcmp(text, "true") == 0 || strcmp(text, "1") == 0;
    return *value || strcmp(text, "no") == 0 || strcmp(text, "false") == 0 || strcmp(text, "0") == 0;
}

/* Parses "16M", "25%" (of the memory available to this process, for bytes), "1024". */
static bool parse_number(const char *text, bool bytes, uint64_t *value)
{
    if (!isdigit((unsigned char)text[0]))
        return false;
    char *end;
    errno = 0;
    *value = strtoull(text, &end, 10);
    if (errno)
        return false;
    if (bytes && strcmp(end, "%") == 0) {
        if (*value > 100)
            return false;
        *value = host_memory_bytes() / 100 * *value;
        return true;
    }
    static const char suffixes[] = "KMGT";
    const char *suffix = bytes && *end ? strchr(suffixes, toupper((unsigned char)*end)) : NULL;
    if (suffix) {
        unsigned shift = 10 * (unsigned)(suffix - suffixes + 1);
        if (*value > UINT64_MAX >> shift)
            return false;
        *value <<= shift;
        end++;
    }
    return *end == '\0';
}

static void *slot(struct config *config, const struct option *option)
{
    return (char *)config + option->offset;
}

static bool set_number(struct config *config, const struct option *option, const char *value, const char *field,
                       struct error *error)
{
    uint64_t number;
    bool bytes = option->type != OPTION_U32;
    if (!parse_number(value, bytes, &number))
        return error_set(error, ERROR_INVALID, field, "\"%s\" is no number%s", value,
                         bytes ? ", nor one with K, M, G, T or %" : "");
    if (number < option->min || number > option->max)
        return error_set(error, ERROR_INVALID, field, "%" PRIu64 " is not within %" PRIu64 " .. %" PRIu64 " %s",
                         number, option->min, option->max, option->unit);
    if (option->type == OPTION_BYTES)
        *(uint64_t *)slot(config, option) = number;
    else if (option->type == OPTION_MEBIBYTES) /* less than one is a limit too */
        *(uint32_t *)slot(config, option) = number > 0 && number < MIB ? 1 : (uint32_t)(number / MIB);
    else
        *(uint32_t *)slot(config, option) = (uint32_t)number;
    return true;
}

static bool set_option(struct config *config, const struct option *option, const char *value, const char *field,
                       struct error *error)
{
    switch (option->type) {
    case OPTION_TEXT:
        if (strlen(value) >= CONFIG_TEXT_BYTES)
            return error_set(error, ERROR_INVALID, field, "longer than %d bytes", CONFIG_TEXT_BYTES - 1);
        strcpy(slot(config, option), value);
        return true;
    case OPTION_BOOL:
        return parse_bool(value, slot(config, option)) ||
               error_set(error, ERROR_INVALID, field, "\"%s\" is neither yes nor no", value);
    case OPTION_LEVEL:
        return parse_level(value, slot(config, option)) ||
               error_set(error, ERROR_INVALID, field, "\"%s\" is not one of error, warning, info, debug", value);
    case OPTION_U32:
    case OPTION_BYTES:
    case OPTION_MEBIBYTES:
        break;
    }
    return set_number(config, option, value, field, error);
}

static const struct option *find(const char *section, size_t section_bytes, const char *key)
{
    for (size_t i = 0; i < OPTION_COUNT; i++) {
        if (strlen(options[i].section) == section_bytes &&
            strncmp(options[i].section, section, section_bytes) == 0 && strcmp(options[i].key, key) == 0)
            return &options[i];
    }
    return NULL;
}

/* Gives users without access to the system's folder a socket of their own. */
static void use_user_socket(struct config *config)
{
    char folder[CONFIG_TEXT_BYTES], listen[CONFIG_TEXT_BYTES];
    if (geteuid() == 0 || access(HOST_RUNTIME_FOLDER, W_OK) == 0 ||
        !host_user_runtime_folder(folder, sizeof(folder)))
        return;
    if ((size_t)snprintf(listen, sizeof(listen), "unix:%s/" SOCKET_NAME, folder) < sizeof(listen))
        memcpy(config->listen, listen, sizeof(listen));
}

void config_defaults(struct config *config)
{
    *config = (struct config){0};
    for (size_t i = 0; i < OPTION_COUNT; i++)
        set_option(config, &options[i], options[i].default_text, options[i].key, NULL);
    use_user_socket(config);
}

static bool set_named(struct config *config, const char *name, const char *value, const char *field,
                      struct error *error)
{
    const char *dot = strchr(name, '.');
    const struct option *option = dot ? find(name, (size_t)(dot - name), dot + 1) : NULL;
    if (dot == name)
        return error_set(error, ERROR_INVALID, field, "a key outside of every [section]");
    if (!option)
        return error_set(error, ERROR_INVALID, field, "there is no such option");
    return set_option(config, option, value, field, error);
}

bool config_flag(struct config *config, const char *name, const char *value, const char *flag, struct error *error)
{
    return !value || set_named(config, name, value, flag, error);
}

static size_t slot_bytes(const struct option *option)
{
    return option->type == OPTION_TEXT    ? CONFIG_TEXT_BYTES
           : option->type == OPTION_BOOL  ? sizeof(bool)
           : option->type == OPTION_BYTES ? sizeof(uint64_t)
                                          : sizeof(uint32_t);
}

static bool is_same(const struct config *a, const struct config *b, const struct option *option)
{
    const char *one = (const char *)a + option->offset, *other = (const char *)b + option->offset;
    if (option->type == OPTION_TEXT)
        return strcmp(one, other) == 0;
    return memcmp(one, other, slot_bytes(option)) == 0;
}

void config_keep_start(struct config *next, const struct config *config)
{
    for (size_t i = 0; i < OPTION_COUNT; i++) {
        const struct option *option = &options[i];
        if (option->time == ANYTIME || is_same(config, next, option))
            continue;
        log_write(LOG_WARNING, "config", "%s.%s is read at the start only: restart the daemon to change it",
                  option->section, option->key);
        memcpy(slot(next, option), (const char *)config + option->offset, slot_bytes(option));
    }
}

/* ---- sources ----------------------------------------------------------------------------------------- */

struct reader {
    struct config *config;
    struct error error; /* the first one; ini_parse_file() returns its line */
};

static int on_value(void *user, const char *section, const char *key, const char *value)
{
    struct reader *reader = user;
    char name[128];
    snprintf(name, sizeof(name), "%s.%s", section, key);
    return set_named(reader->config, name, value, name, &reader->error);
}

bool config_read_file(struct config *config, const char *path, bool optional, struct error *error)
{
    FILE *file = fopen(path, "re");
    if (!file) {
        if (optional && errno == ENOENT)
            return true;
        return error_set(error, ERROR_INVALID, path, "%s", strerror(errno));
    }
    struct reader reader = {.config = config};
    int line = ini_parse_file(file, on_value, &reader);
    fclose(file);
    if (line == 0)
        return true;
    char field[sizeof(error->field)];
    snprintf(field, sizeof(field), "%s:%d", path, line);
    if (reader.error.kind == ERROR_NONE)
        return error_set(error, ERROR_INVALID, field, "neither a [section] nor key = value");
    return error_set(error, ERROR_INVALID, field, "%s: %s", reader.error.field, reader.error.text);
}

bool config_read_environment(struct config *config, struct error *error)
{
    for (size_t i = 0; i < OPTION_COUNT; i++) {
        char name[128];
        snprintf(name, sizeof(name), "FARLIGHT_%s_%s", options[i].section, options[i].key);
        for (char *c = name; *c; c++)
            *c = (char)toupper((unsigned char)*c);
        const char *value = getenv(name);
        if (value && !set_option(config, &options[i], value, name, error))
            return false;
    }
    return true;
}

static struct engine_limits engine_limits(const struct config *config)
{
    return (struct engine_limits){
        .scene = {.host_bytes = config->scene_bytes, .nodes = config->limits.nodes, .depth = config->limits.depth},
        .scene_linger_ms = config->scene_linger_s * UINT64_C(1000),
        .lingering_scenes = config->lingering_scenes,
    };
}

bool config_engine(const struct config *config, struct engine_options *engine, struct error *error)
{
    *engine = (struct engine_options){
        .gpu = {.index = -1, .binaries_bytes = config->program_bytes},
        .encode_threads = config->encode_threads,
        .limits = engine_limits(config),
        .device_bytes_limit = config->device_bytes,
    };
#ifdef FARLIGHT_DEBUG
    engine->gpu.debug = true;
#endif
    if (strcmp(config->device, "auto") == 0)
        return true;
    engine->gpu.software = strcmp(config->device, "software") == 0;
    uint64_t index;
    if (engine->gpu.software)
        return true;
    if (!parse_number(config->device, false, &index) || index > INT16_MAX)
        return error_set(error, ERROR_INVALID, "engine.device",
                         "\"%s\" is no number of --list-devices, nor "
                         "software, nor auto",
                         config->device);
    engine->gpu.index = (int)index;
    return true;
}

void config_hub(const struct config *config, struct hub_options *hub)
{
    *hub = (struct hub_options){
        .limits = config->limits,
        .connection_limits = config->connection,
        .engine_limits = engine_limits(config),
    };
    hub->limits.frames_in_flight = ENGINE_FRAMES_IN_FLIGHT;
}

/* Clients of a single owner, at least 1. */
static uint32_t clients_of_one(const struct session_limits *limits)
{
    const uint64_t share = (uint64_t)limits->clients * limits->share_percent / 100;
    return share ? (uint32_t)share : 1;
}

bool config_front(const struct config *config, struct front_options *front, struct error *error)
{
    *front = (struct front_options){
        .limits = {.clients = config->limits.clients,
                   .clients_of_one = clients_of_one(&config->limits),
                   .unauthenticated = config->limits.unauthenticated,
                   .unauthenticated_per_address = config->limits.unauthenticated_per_address,
                   .handshakes_a_second = config->limits.handshakes_a_second},
        .connection_limits = config->connection,
        .insecure = config->insecure,
        .unused_ns = config->unused_s * UINT64_C(1000000000),
        .owner_fd = -1,
    };
    return readers_parse(&front->readers, config->readers, "server.readers", error) &&
           shares_parse(&front->shares, config->weights, "server.weights", error) &&
           auth_read_keys(&front->keys, config->key_file, config->reader_key_file, error);
}

/* ---- dump -------------------------------------------------------------------------------------------- */

static void print_value(const struct config *config, const struct option *option, FILE *stream)
{
    const void *value = (const char *)config + option->offset;
    switch (option->type) {
    case OPTION_TEXT:
        fprintf(stream, "%s", (const char *)value);
        return;
    case OPTION_BOOL:
        fprintf(stream, "%s", *(const bool *)value ? "yes" : "no");
        return;
    case OPTION_LEVEL:
        fprintf(stream, "%s", log_level_name((enum log_level) * (const uint32_t *)value));
        return;
    case OPTION_U32:
        fprintf(stream, "%" PRIu32, *(const uint32_t *)value);
        return;
    case OPTION_BYTES:
        fprintf(stream, "%" PRIu64, *(const uint64_t *)value);
        return;
    case OPTION_MEBIBYTES:
        fprintf(stream, "%" PRIu64, *(const uint32_t *)value * MIB);
        return;
    }
}

/* Prints a comment in short lines, as readers of the file limit their length. */
static void print_comment(const char *text, FILE *stream)
{
    size_t column = 0;
    while (*text) {
        size_t word_bytes = strcspn(text, " ");
        if (column == 0 || column + 1 + word_bytes > COMMENT_COLUMNS)
            column = (size_t)fprintf(stream, "%s#", column ? "\n" : "");
        column += (size_t)fprintf(stream, " %.*s", (int)word_bytes, text);
        text += word_bytes + (text[word_bytes] != '\0');
    }
    fprintf(stream, "\n");
}

static void print_doc(const struct option *option, FILE *stream)
{
    char text[COMMENT_MAX_BYTES], range[64] = "";
    if (option->type == OPTION_U32 || option->type == OPTION_BYTES || option->type == OPTION_MEBIBYTES)
        snprintf(range, sizeof(range), " %" PRIu64 " .. %" PRIu64 "%s%s.", option->min, option->max,
                 option->unit[0] ? " " : "", option->unit);
    snprintf(text, sizeof(text), "%s.%s%s", option->doc, option->time == START ? " Read at the start only." : "",
             range);
    print_comment(text, stream);
}

bool config_dump(const struct config *config, FILE *stream)
{
    struct config defaults;
    config_defaults(&defaults);
    fprintf(stream, "# farlightd %s. Options that are commented out have their defaults.\n", FARLIGHT_VERSION);
    for (size_t i = 0; i < OPTION_COUNT; i++) {
        const struct option *option = &options[i];
        if (i == 0 || strcmp(option->section, options[i - 1].section) != 0)
            fprintf(stream, "\n[%s]\n", option->section);
        print_doc(option, stream);
        /* A default is printed as in the table, since some depend on the host. */
        if (is_same(config, &defaults, option)) {
            fprintf(stream, "#%s = %s\n", option->key, option->default_text);
            continue;
        }
        fprintf(stream, "%s = ", option->key);
        print_value(config, option, stream);
        fprintf(stream, "\n");
    }
    return fflush(stream) == 0 && !ferror(stream);
}
