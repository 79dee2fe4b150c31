/* SPDX-License-Identifier: MIT */
/* What can be set: one row per option, from which parsing, checks and the commented file come. A flag goes over
 * FARLIGHT_<SECTION>_<KEY> in the environment, over --config FILE, over /etc/farlight/farlightd.conf, over the
 * default. An unknown key is an error that names file and line. */
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
    uint32_t unused_s;              /* without a client, after which the daemon ends; 0: it does not */
    char device[CONFIG_TEXT_BYTES]; /* "auto", "software" or a number */
    uint32_t encode_threads;
    uint64_t scene_bytes, device_bytes, program_bytes;
    uint32_t scene_linger_s, lingering_scenes;
    char store[CONFIG_TEXT_BYTES]; /* folder of the scenes on disk; empty: there are none */
    uint64_t store_bytes;
    struct session_limits limits;
    struct connection_limits connection;
};

void config_defaults(struct config *config);
/* One option, as "section.key". The error's field begins with `flag`. A NULL value was not given: nothing is done.
 */
bool config_flag(struct config *config, const char *name, const char *value, const char *flag,
                 struct error *error);
/* A missing file is an error unless `optional`. */
bool config_read_file(struct config *config, const char *path, bool optional, struct error *error);
bool config_read_environment(struct config *config, struct error *error);
/* The engine's share; false: the device is not said in a way that can be understood. */
bool config_engine(const struct config *config, struct engine_options *options, struct error *error);
/* The sessions' share; the engine and the keys are not in it. */
void config_hub(const struct config *config, struct hub_options *options);
/* The front's, with what is in the key files; the workers' setup is not in it. False: something cannot be
 * understood, or read. */
bool config_front(const struct config *config, struct front_options *options, struct error *error);
/* What may not change while the daemon runs is in `next` as it is in `config`, afterwards; the log names each that
 * was not. */
void config_keep_start(struct config *next, const struct config *config);
bool config_dump(const struct config *config, FILE *stream); /* false: the stream fails */

#endif
