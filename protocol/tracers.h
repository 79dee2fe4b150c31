/* SPDX-License-Identifier: MIT */
/* What tracers.def says, as structs and functions for everybody: the server, which knows no messages below its
 * sessions, the client and the tests. */
#ifndef FARLIGHT_PROTOCOL_TRACERS_H
#define FARLIGHT_PROTOCOL_TRACERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* struct ldc_settings and its like. 32-bit words alone, so that two can be compared byte by byte; a choice has the
 * number of its value. All-zero is the default of each. */
/* clang-format off */
#define SETTINGS(tracer) struct tracer##_settings {
#define SETTINGS_END(tracer) };
#define SETTING_WHOLE(tracer, field, min, max, default_value, unit, doc) uint32_t field;
#define SETTING_ONE_OF(tracer, field, numbers, max, default_value, unit, doc) uint32_t field;
#define SETTING_REAL(tracer, field, min, max, default_value, unit, doc) float field;
#define SETTING_CHOICE(tracer, field, choices, doc) uint32_t field;
#include "protocol/tracers.def"

/* Those of all tracers; a tracer looks at its own. */
struct tracer_settings {
#define SETTINGS(tracer) struct tracer##_settings tracer;
#include "protocol/tracers.def"
};

/* What the daemon allows, words likewise: <tracer>_mebibytes of device memory and counts; 0: no limit. */
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
    const char *needs; /* what a build may lack; "": nothing */
    const char *doc;
};

#ifdef __cplusplus
extern "C" {
#endif

extern const struct tracer_desc tracer_descs[]; /* ascending numbers */
extern const size_t tracer_desc_count;
const struct tracer_desc *tracer_describe(uint32_t number); /* NULL: there is none */

struct setting_fault {
    char field[64];   /* behind the prefix: "options.ldc_form" */
    char text[192];   /* what is wrong, with the value, and what is allowed */
    char remedy[128]; /* may be empty */
};

/* Whether every setting is allowed, alone and beside the others. False: *fault says why not. Fields are named
 * `prefix` and their name, behind the prefix "--" as on the command line. */
bool tracer_settings_check(const struct tracer_settings *settings, const char *prefix,
                           struct setting_fault *fault);
/* Puts the defaults in the place of zeros that stand for them. */
void tracer_settings_resolve(struct tracer_settings *settings);

#ifdef __cplusplus
}
#endif
#endif
