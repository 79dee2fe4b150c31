/* SPDX-License-Identifier: MIT */
/* Users of the Unix socket who may view scenes and not change them. */
#ifndef FARLIGHT_NET_READERS_H
#define FARLIGHT_NET_READERS_H

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define READERS_MAX 64

struct readers {
    uint32_t users[READERS_MAX];
    size_t count;
};

/* Parses names and numbers, separated by blanks. False with ERROR_INVALID: one is unknown, or there are too
 * many; `field` is the error's field. */
bool readers_parse(struct readers *readers, const char *text, const char *field, struct error *error);
/* Reads a user's name or number; false: there is no such user. */
bool readers_parse_user(const char *text, uint32_t *user);
bool readers_have(const struct readers *readers, uint32_t user);

#endif
