/* SPDX-License-Identifier: MIT */
/* Reads the limits of control groups. */
#include "base/cgroup.h"

#include <errno.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint64_t lower(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

/* Reads a limit; "max" is none. Version 1 writes a number near 2^63, which is more than any host has. */
static uint64_t read_limit(const char *folder, const char *name)
{
    char path[PATH_MAX], text[32], *end;
    if (snprintf(path, sizeof(path), "%s/%s", folder, name) >= (int)sizeof(path))
        return UINT64_MAX;
    FILE *file = fopen(path, "re");
    const bool is_read = file && fgets(text, sizeof(text), file);
    if (file)
        fclose(file);
    if (!is_read || text[0] < '0' || text[0] > '9')
        return UINT64_MAX;
    errno = 0;
    const unsigned long long bytes = strtoull(text, &end, 10);
    return errno || (*end && *end != '\n') ? UINT64_MAX : bytes;
}

/* Minimum of the limits on a path. Within a container the mount may begin at the container's group, while the
 * path is the host's: missing folders are skipped, up to the mount itself. */
static uint64_t lowest_of_branch(const char *mount, const char *path)
{
    char folder[PATH_MAX];
    const size_t mount_bytes = strlen(mount);
    uint64_t bytes = UINT64_MAX;
    if (snprintf(folder, sizeof(folder), "%s%s", mount, path) >= (int)sizeof(folder))
        return UINT64_MAX;
    for (;;) {
        bytes = lower(bytes, read_limit(folder, "memory.max"));
        bytes = lower(bytes, read_limit(folder, "memory.high"));
        bytes = lower(bytes, read_limit(folder, "memory.limit_in_bytes"));
        char *slash = strrchr(folder + mount_bytes, '/');
        if (!slash)
            return bytes;
        *slash = '\0';
    }
}

/* Whether a comma-separated list has the word. */
static bool has_word(const char *list, const char *word)
{
    const size_t bytes = strlen(word);
    for (const char *at = list; (at = strstr(at, word)); at += bytes)
        if ((at == list || at[-1] == ',') && (at[bytes] == ',' || at[bytes] == '\0'))
            return true;
    return false;
}

/* Limit of a line "NUMBER:CONTROLLERS:PATH"; version 2 has the number 0 and no controllers. */
static uint64_t limit_of_line(char *line, const char *root)
{
    char mount[PATH_MAX], *controllers = strchr(line, ':'),
                          *path = controllers ? strchr(controllers + 1, ':') : NULL;
    if (!path)
        return UINT64_MAX;
    *controllers++ = *path++ = '\0';
    path[strcspn(path, "\n")] = '\0';
    const bool is_2 = controllers[0] == '\0';
    if (!is_2 && !has_word(controllers, "memory"))
        return UINT64_MAX;
    return snprintf(mount, sizeof(mount), "%s%s", root, is_2 ? "" : "/memory") < (int)sizeof(mount)
               ? lowest_of_branch(mount, path)
               : UINT64_MAX;
}

uint64_t cgroup_memory_limit_bytes(const char *groups_file, const char *root)
{
    char line[PATH_MAX];
    uint64_t bytes = UINT64_MAX;
    FILE *file = fopen(groups_file, "re");
    while (file && fgets(line, sizeof(line), file))
        bytes = lower(bytes, limit_of_line(line, root));
    if (file)
        fclose(file);
    return bytes;
}
