/* SPDX-License-Identifier: MIT */
/* The rules that one value must keep, for the encoder and the decoder alike. Internal to protocol/. */
#ifndef FARLIGHT_PROTOCOL_CHECK_H
#define FARLIGHT_PROTOCOL_CHECK_H

#include "protocol/describe.h"

/* Where in a message we are: a chain on the C stack, only turned into text when something is wrong. */
struct path {
    const struct path *parent; /* NULL: the message */
    const char *name;
    int64_t index; /* below 0: none */
};

/* Fills *error with the path and returns false. */
bool check_fail(struct decode_error *error, enum protocol_error_code code, const struct path *path,
                const char *format, ...) __attribute__((format(printf, 4, 5)));

/* A fixed field in memory: range, list of values, finite. `parent` is the struct's path. */
bool check_fixed(const struct field_desc *field, const void *place, const struct path *parent,
                 struct decode_error *error);
bool check_count(const struct field_desc *field, uint64_t count, const struct path *path,
                 struct decode_error *error);
bool check_text(const uint8_t *bytes, size_t count, const struct path *path, struct decode_error *error);

#endif
