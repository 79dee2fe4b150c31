/* SPDX-License-Identifier: MIT */
/* Options of the daemon: one row each, from which parsing, checks and the commented file are derived. A flag
 * overrides FARLIGHT_<SECTION>_<KEY> in the environment, that overrides --config FILE, then
 * /etc/farlight/farlightd.conf, then the default. An unknown key is an error that names file and line. */
#ifndef FARLIGHT_CONFIG_H
#define FARLIGHT_CONFIG_H

#include "base/error.h"
#include "engine/engine.h"
#include "front/front.h"
#include "session/hub.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#define CONFIG_SYSTEM_FILE "/etc/farlight/farlightd.conf"
#define CONFIG_TEXT_BYTES 512

struct config {
    char listen[CONFIG_TEXT_BYTES];  /* addresses, separated by blanks */
    char readers[CONFIG_TEXT_BYTES]; /* users, separated by blanks */
    char weights[CONFIG_TEXT_BYTES]; /* NAME=WEIGHT, separated by blanks */
    bool insecure;
    bool sandbox;
    char key_file[CONFIG_TEXT_BYTES], reader_key_file[CONFIG_TEXT_BYTES]; /* empty: none */
    uint32_t log_level;
    char trace_file[CONFIG_TEXT_BYTES]; /* empty: none */
    uint64_t trace_file_bytes;
    uint32_t unused_s;              /* time without a client after which the daemon ends; 0: never */
    char device[CONFIG_TEXT_BYTES]; /* "auto", "software" or a number */
    uint32_t encode_threads;
    uint64_t scene_bytes, device_bytes, program_bytes;
    uint32_t scene_linger_s, lingering_scenes;
    char store[CONFIG_TEXT_BYTES]; /* folder of the scenes on disk; empty: none */
    uint64_t store_bytes;
    struct session_limits limits;
    struct connection_limits connection;
};

void config_defaults(struct config *config);
/* Sets one option, named "section.key". The error's field begins with `flag`. A NULL value was not given:
 * nothing happens. */
bool config_flag(struct config *config, const char *name, const char *value, const char *flag,
                 struct error *error);
/* Reads a file; a missing one is an error unless `optional`. */
bool config_read_file(struct config *config, const char *path, bool optional, struct error *error);
bool config_read_environment(struct config *config, struct error *error);
/* Gets the engine's options. False: the device is not a valid name. */
bool config_engine(const struct config *config, struct engine_options *options, struct error *error);
/* Gets the sessions' options, without the engine and the keys. */
void config_hub(const struct config *config, struct hub_options *options);
/* Gets the front's options, with the contents of the key files but without the workers' setup. False: something
 * is invalid or cannot be read. */
bool config_front(const struct config *config, struct front_options *options, struct error *error);
/* Copies options that may not change while the daemon runs from `config` to `next`; the log names each one that
 * differed. */
void config_keep_start(struct config *next, const struct config *config);
bool config_dump(const struct config *config, FILE *stream); /* false: the stream fails */

#endif
