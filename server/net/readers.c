/* SPDX-License-Identifier: MIT */
/* List of read-only users. */
#include "net/readers.h"

#include <errno.h>
#include <pwd.h>
#include <stdlib.h>
#include <string.h>

bool readers_parse_user(const char *text, uint32_t *user)
{
    char *end;
    errno = 0;
    unsigned long number = strtoul(text, &end, 10);
    if (!errno && *text >= '0' && *text <= '9' && !*end && number < UINT32_MAX) {
        *user = (uint32_t)number;
        return true;
    }
    const struct passwd *entry = getpwnam(text);
    if (entry)
        *user = entry->pw_uid;
    return entry != NULL;
}

static bool add(struct readers *readers, const char *text, const char *field, struct error *error)
{
    if (readers->count == READERS_MAX)
        return error_set(error, ERROR_INVALID, field, "more than %d users", READERS_MAX);
    if (!readers_parse_user(text, &readers->users[readers->count]))
        return error_set(error, ERROR_INVALID, field, "there is no user \"%s\"", text);
    readers->count++;
    return true;
}

bool readers_parse(struct readers *readers, const char *text, const char *field, struct error *error)
{
    *readers = (struct readers){0};
    char *copy = strdup(text), *rest = copy;
    bool ok = copy || error_set(error, ERROR_OUT_OF_MEMORY, field, "no memory");
    for (char *one; ok && (one = strsep(&rest, " \t"));)
        ok = !one[0] || add(readers, one, field, error);
    free(copy);
    return ok;
}

bool readers_have(const struct readers *readers, uint32_t user)
{
    for (size_t i = 0; i < readers->count; i++) {
        if (readers->users[i] == user)
            return true;
    }
    return false;
}
