/* SPDX-License-Identifier: MIT */
/* Checks of single values against the rules of the table. */
#include "protocol/check.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Writes "parent.name[index]", cut off where it does not fit. */
static void path_text(const struct path *path, char *out, size_t out_bytes)
{
    if (path->parent) {
        path_text(path->parent, out, out_bytes);
    }
    size_t used = strlen(out);
    snprintf(out + used, out_bytes - used, "%s%s", path->parent ? "." : "", path->name);
    used = strlen(out);
    if (path->index >= 0) {
        snprintf(out + used, out_bytes - used, "[%" PRId64 "]", path->index);
    }
}

bool check_fail(struct decode_error *error, enum protocol_error_code code, const struct path *path,
                const char *format, ...)
{
    char text[sizeof(error->text)];
    char field[sizeof(error->field)] = "";
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof(text), format, arguments);
    va_end(arguments);
    path_text(path, field, sizeof(field));
    return decode_error_set(error, code, field, "%s", text);
}

static bool check_int(const struct field_desc *field, const void *place, const struct path *path,
                      struct decode_error *error)
{
    uint64_t value = field_load_int(field, place);
    char allowed[96], instead[32];
    if (field_has_number(field, value)) {
        return true;
    }
    if (!field->zero_is_default) {
        return check_fail(error, PROTOCOL_ERROR_INVALID, path, "%" PRIu64 " is not within %" PRIu64 " .. %" PRIu64,
                          value, field->min, field->max);
    }
    return check_fail(error, PROTOCOL_ERROR_INVALID, path, "%" PRIu64 " is not one of %s (0: %s)", value,
                      field_allowed_text(field, allowed, sizeof(allowed)),
                      field_default_text(field, instead, sizeof(instead)));
}

static bool check_enum(const struct field_desc *field, const void *place, const struct path *path,
                       struct decode_error *error)
{
    uint32_t value = (uint32_t)field_load_int(field, place);
    char list[96];
    if (!enum_desc_text(field->enumeration, value)) {
        return check_fail(error, PROTOCOL_ERROR_INVALID, path, "%" PRIu32 " is none of: %s", value,
                          protocol_enum_list(field->enumeration->name, list, sizeof(list)));
    }
    return true;
}

static bool check_reals(const struct field_desc *field, const void *place, const struct path *parent,
                        struct decode_error *error)
{
    for (uint32_t i = 0; i < field->count; i++) {
        struct path path = {parent, field->name, field->count > 1 ? (int64_t)i : -1};
        float value;
        memcpy(&value, (const char *)place + 4 * i, 4);
        if (!isfinite(value)) {
            return check_fail(error, PROTOCOL_ERROR_INVALID, &path, "%g is no finite number", (double)value);
        }
        const bool is_default = field->zero_is_default && !(value > 0.0f || value < 0.0f);
        if (!is_default && (value < field->real_min || value > field->real_max)) {
            return check_fail(error, PROTOCOL_ERROR_INVALID, &path, "%.9g is not within %g .. %g", (double)value,
                              (double)field->real_min, (double)field->real_max);
        }
    }
    return true;
}

bool check_fixed(const struct field_desc *field, const void *place, const struct path *parent,
                 struct decode_error *error)
{
    struct path path = {parent, field->name, -1};
    switch (field->kind) {
    case FIELD_INT:
        return check_int(field, place, &path, error);
    case FIELD_ENUM:
        return check_enum(field, place, &path, error);
    case FIELD_REAL:
        return check_reals(field, place, parent, error);
    default:
        return true;
    }
}

bool check_count(const struct field_desc *field, uint64_t count, const struct path *path,
                 struct decode_error *error)
{
    if (count > field->max) {
        return check_fail(error, PROTOCOL_ERROR_INVALID, path, "%" PRIu64 " %s, at most %" PRIu64, count,
                          field->kind == FIELD_ARRAY ? "elements" : "bytes", field->max);
    }
    return true;
}

bool check_text(const uint8_t *bytes, size_t count, const struct path *path, struct decode_error *error)
{
    if (!utf8_valid(bytes, count)) {
        return check_fail(error, PROTOCOL_ERROR_INVALID, path, "no UTF-8 text without NUL");
    }
    return true;
}
