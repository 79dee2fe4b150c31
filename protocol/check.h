/* SPDX-License-Identifier: MIT */
/* The rules for single values, shared by the encoder and the decoder. Internal to protocol/. */
#ifndef FARLIGHT_PROTOCOL_CHECK_H
#define FARLIGHT_PROTOCOL_CHECK_H

#include "protocol/describe.h"

/* The position in a message: a chain on the C stack, turned into text only for an error. */
struct path {
    const struct path *parent; /* NULL: the message */
    const char *name;
    int64_t index; /* below 0: not an element */
};

/* Fills *error with the path and returns false. */
bool check_fail(struct decode_error *error, enum protocol_error_code code, const struct path *path,
                const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Checks a fixed field in memory: range, list of values, finite. `parent` is the struct's path. */
bool check_fixed(const struct field_desc *field, const void *place, const struct path *parent,
                 struct decode_error *error);
bool check_count(const struct field_desc *field, uint64_t count, const struct path *path,
                 struct decode_error *error);
bool check_text(const uint8_t *bytes, size_t count, const struct path *path, struct decode_error *error);

#endif
