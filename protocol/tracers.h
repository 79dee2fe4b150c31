/* SPDX-License-Identifier: MIT */
/* The tracers of tracers.def and their settings, as structs and functions for everybody: the client, the tests,
 * and the server, which knows no messages below its sessions. */
#ifndef FARLIGHT_PROTOCOL_TRACERS_H
#define FARLIGHT_PROTOCOL_TRACERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* struct ldc_settings and the like have 32-bit members only, so that two can be compared byte by byte; a choice
 * is the number of its value. All zero is the default of each. */
/* clang-format off */
#define SETTINGS(tracer) struct tracer##_settings {
#define SETTINGS_END(tracer) };
#define SETTING_WHOLE(tracer, field, min, max, default_value, unit, doc) uint32_t field;
#define SETTING_ONE_OF(tracer, field, numbers, max, default_value, unit, doc) uint32_t field;
#define SETTING_REAL(tracer, field, min, max, default_value, unit, doc) float field;
#define SETTING_CHOICE(tracer, field, choices, doc) uint32_t field;
#include "protocol/tracers.def"

/* The settings of all tracers; a tracer reads its own. */
struct tracer_settings {
#define SETTINGS(tracer) struct tracer##_settings tracer;
#include "protocol/tracers.def"
};

/* The daemon's limits, as 32-bit words too: <tracer>_mebibytes of device memory, and counts; 0: no limit. */
struct tracer_limits {
#define MEMORY_LIMIT(tracer, doc) uint32_t tracer##_mebibytes;
#define TRACER_LIMIT(tracer, field, min, max, doc) uint32_t tracer##_##field;
#include "protocol/tracers.def"
};
/* clang-format on */

struct tracer_desc {
    const char *name;
    uint32_t number;
    bool is_for_tests;
    const char *needs; /* a dependency that a build may lack; "": none */
    const char *doc;
};

#ifdef __cplusplus
extern "C" {
#endif

extern const struct tracer_desc tracer_descs[]; /* ascending numbers */
extern const size_t tracer_desc_count;
const struct tracer_desc *tracer_describe(uint32_t number); /* NULL: there is none */

struct setting_fault {
    char field[64];   /* with the prefix: "options.ldc_form" */
    char text[192];   /* a sentence with the value and the allowed ones */
    char remedy[128]; /* may be empty */
};

/* Checks every setting alone and against the others. False: *fault has the reason. Fields are named `prefix`
 * and their name, with the prefix "--" as on the command line. */
bool tracer_settings_check(const struct tracer_settings *settings, const char *prefix,
                           struct setting_fault *fault);
/* Replaces zeros that stand for defaults by the defaults. */
void tracer_settings_resolve(struct tracer_settings *settings);

#ifdef __cplusplus
}
#endif
#endif
