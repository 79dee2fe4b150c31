/* SPDX-License-Identifier: MIT */
/* Checks and defaults of the tracers' settings. */
#include "protocol/tracers.h"

#include "protocol/check.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define IS_FOR_EVERYBODY false
#define IS_FOR_TESTS true
const struct tracer_desc tracer_descs[] = {
#define TRACER(NAME, name, number, use, needs, doc) {#name, number, IS_FOR_##use, needs, doc},
#include "protocol/tracers.def"
};
const size_t tracer_desc_count = sizeof(tracer_descs) / sizeof(tracer_descs[0]);

/* Pairs of whole numbers where `field` may not exceed `other`. */
static const struct rule {
    const char *field, *other;
} rules[] = {
#define NOT_ABOVE(tracer, field, other) {#tracer "_" #field, #tracer "_" #other},
#include "protocol/tracers.def"
};

const struct tracer_desc *tracer_describe(uint32_t number)
{
    for (size_t i = 0; i < tracer_desc_count; i++) {
        if (tracer_descs[i].number == number) {
            return &tracer_descs[i];
        }
    }
    return NULL;
}

/* Settings are described as fields of the record that carries them. */
static const struct struct_desc *carrier(void)
{
    return struct_field(message_describe(MESSAGE_RENDER)->body(), "tracing")->record();
}

static void *place_of(const struct tracer_settings *settings, const struct field_desc *field)
{
    return (char *)(uintptr_t)settings + (field->offset - offsetof(struct record_tracing, settings));
}

/* The name as it is typed: --ldc-form for the prefix "--". */
static const char *named(const char *prefix, const char *name, char *out, size_t out_bytes)
{
    snprintf(out, out_bytes, "%s%s", prefix, name);
    for (char *at = out; strcmp(prefix, "--") == 0 && *at != '\0'; at++) {
        *at = *at == '_' ? '-' : *at;
    }
    return out;
}

static bool check_alone(const struct tracer_settings *settings, const char *prefix, struct setting_fault *fault)
{
    for (const struct field_desc *field = carrier()->fields; field->name; field++) {
        struct decode_error error = {0};
        if (!field->tracer || check_fixed(field, place_of(settings, field), NULL, &error)) {
            continue;
        }
        named(prefix, field->name, fault->field, sizeof(fault->field));
        snprintf(fault->text, sizeof(fault->text), "%s", error.text);
        return false;
    }
    return true;
}

static bool is_zero(const struct field_desc *field, const void *place)
{
    float real;
    memcpy(&real, place, sizeof(real));
    return field->kind == FIELD_REAL ? !(real > 0.0f || real < 0.0f) : field_load_int(field, place) == 0;
}

/* `settings` must be resolved. */
static bool check_rule(const struct tracer_settings *settings, const struct rule *rule, const char *prefix,
                       struct setting_fault *fault)
{
    const struct field_desc *field = struct_field(carrier(), rule->field),
                            *other = struct_field(carrier(), rule->other);
    const uint64_t value = field_load_int(field, place_of(settings, field)),
                   limit = field_load_int(other, place_of(settings, other));
    char other_name[64];
    named(prefix, field->name, fault->field, sizeof(fault->field));
    named(strcmp(prefix, "--") == 0 ? prefix : "", other->name, other_name, sizeof(other_name));
    snprintf(fault->text, sizeof(fault->text), "%" PRIu64 " is more than the %" PRIu64 " %s of %s", value, limit,
             other->unit, other_name);
    snprintf(fault->remedy, sizeof(fault->remedy), "choose a lower number, or a higher %s", other_name);
    return limit == 0 || value <= limit; /* 0: the tracer chooses */
}

bool tracer_settings_check(const struct tracer_settings *settings, const char *prefix, struct setting_fault *fault)
{
    struct tracer_settings resolved = *settings;
    *fault = (struct setting_fault){0};
    if (!check_alone(settings, prefix, fault)) {
        return false;
    }
    tracer_settings_resolve(&resolved);
    for (size_t i = 0; i < sizeof(rules) / sizeof(rules[0]); i++) {
        if (!check_rule(&resolved, &rules[i], prefix, fault)) {
            return false;
        }
    }
    *fault = (struct setting_fault){0};
    return true;
}

void tracer_settings_resolve(struct tracer_settings *settings)
{
    for (const struct field_desc *field = carrier()->fields; field->name; field++) {
        if (field->tracer && field->zero_is_default && is_zero(field, place_of(settings, field))) {
            field_default(field, place_of(settings, field));
        }
    }
}
